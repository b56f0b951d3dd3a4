"""Programs that work, fail, hang, flood and leave others behind."""

from __future__ import annotations

import os
import sys
import time

import psutil
import pytest

from drivers.program import runner
from drivers.scanner import DeviceError, SettingsError

LIMIT_S = 60.0  # of programs that end by themselves, at once on a machine with time


class Cancelled(Exception):
    """Raised from `progress`, as the console's cancel is."""


def run(folder, script, *, limit_s=LIMIT_S, progress=lambda _step, _done: None):
    command = [sys.executable, "-c", script]
    return runner.run(command, folder=folder, environment={"OWN": "7"}, limit_s=limit_s, progress=progress)


def test_a_program_runs_in_its_folder_with_our_environment(tmp_path):
    script = "import os; print(os.getcwd(), os.environ['OWN'], os.getpgid(0) == os.getpid(), 'PATH' in os.environ)"
    assert run(tmp_path, script).split() == [str(tmp_path), "7", "True", "True"]


def test_progress_is_reported(tmp_path):
    steps = []
    script = "print('warming up\\nprogress 0.4 projecting\\nprogress 1\\nprogress 9')"
    run(tmp_path, script, progress=lambda *step: steps.append(step))
    assert steps[-1] == ("projecting" if ("projecting", 0.4) in steps else "capture", 1.0)


def test_the_last_lines_of_the_error_say_why(tmp_path):
    script = "import sys\nfor n in range(9): print('line', n, file=sys.stderr)\nsys.exit(3)"
    with pytest.raises(DeviceError, match="ended with code 3: line 4; line 5; line 6; line 7; line 8") as caught:
        run(tmp_path, script)
    assert caught.value.hint


def test_a_program_that_is_killed(tmp_path):
    with pytest.raises(DeviceError, match="was ended by signal 9"):
        run(tmp_path, "import os; os.kill(os.getpid(), 9)")


def test_a_flood_of_output_neither_blocks_nor_is_kept(tmp_path):
    script = "import sys; [f.write('x' * 1000000) for f in (sys.stdout, sys.stderr)]; sys.exit(1)"
    with pytest.raises(DeviceError) as caught:
        run(tmp_path, script)
    assert len(str(caught.value)) < 3000


HANGS = """
import pathlib, signal, subprocess, sys, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
pathlib.Path("child").write_text(str(child.pid))
time.sleep(600)
"""


def is_gone(pid: int) -> bool:
    deadline = time.monotonic() + LIMIT_S
    while time.monotonic() < deadline:
        if not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE:
            return True
        time.sleep(0.01)
    return False


@pytest.mark.parametrize("way", ["limit", "cancel"])
def test_a_program_that_hangs_is_ended_with_all_that_it_started(tmp_path, way):
    def progress(_step, _done):
        if way == "cancel" and (tmp_path / "child").exists() and (tmp_path / "child").read_text():
            raise Cancelled

    ticks = iter([0.0])

    def clock():  # beyond the limit when the child runs
        started = (tmp_path / "child").exists() and (tmp_path / "child").read_text()
        return next(ticks, 100.0 if way == "limit" and started else 0.0)

    command = [sys.executable, "-c", HANGS]
    with pytest.raises(DeviceError if way == "limit" else Cancelled):
        runner.run(command, folder=tmp_path, environment={}, limit_s=50, progress=progress, grace_s=0.1, clock=clock)
    assert is_gone(int((tmp_path / "child").read_text()))


def test_what_a_program_leaves_behind_does_not_hold_the_capture(tmp_path):
    script = """import subprocess, sys
print(subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"]).pid)"""
    assert is_gone(int(run(tmp_path, script)))


def test_a_program_that_cannot_be_started(tmp_path):
    (tmp_path / "text").write_text("no program")
    with pytest.raises(SettingsError, match="cannot be started"):
        runner.run([str(tmp_path / "text")], folder=tmp_path, environment=dict(os.environ), limit_s=1, progress=print)
