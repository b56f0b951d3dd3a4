"""Restorations in a process of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children
from pathlib import Path

import pytest

from station.session.derivation.restoration import run_restore
from station.workers.background import background

MISSING = "scan that is not there"


def test_a_worker_that_is_killed_is_replaced(tmp_path):
    with background(run_restore) as submit:
        first = submit(tmp_path / MISSING, {}, tmp_path / "a")
        assert "error" in first.result(timeout=200).result
        (worker,) = active_children()
        os.kill(worker.pid, signal.SIGKILL)
        worker.join()
        second = submit(tmp_path / MISSING, {}, tmp_path / "b")
        try:
            result = second.result(timeout=200)
        except BrokenProcessPool:
            result = submit(tmp_path / MISSING, {}, tmp_path / "b").result(timeout=200)
        assert "error" in result.result
    assert active_children() == []


def test_an_error_ends_the_worker_at_once(tmp_path):
    with pytest.raises(KeyboardInterrupt), background(run_restore) as submit:
        submit(tmp_path / MISSING, {}, tmp_path / "a")
        raise KeyboardInterrupt
    assert active_children() == []


PARENT = """
import os, sys
from multiprocessing import get_context
from station.workers.background import prepare_worker
def work(parent):
    prepare_worker(parent)
    print(os.getpid(), flush=True)
    import time
    time.sleep(100)
if __name__ == "__main__":
    get_context("fork").Process(target=work, args=(os.getpid(),)).start()
    sys.stdin.read()
"""


def test_a_worker_ends_with_its_parent():
    with subprocess.Popen([sys.executable, "-c", PARENT], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        worker = int(parent.stdout.readline())
        parent.kill()
    for _ in range(200):
        if not _runs(worker):
            return
        time.sleep(0.05)
    pytest.fail("the worker outlives its parent")


def _runs(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
