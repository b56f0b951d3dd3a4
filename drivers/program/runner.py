"""Run a program in a process group of its own: its progress, its error, its end."""

from __future__ import annotations

import os
import re
import selectors
import signal
import subprocess
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from time import monotonic

from drivers.safety.parking import run_parked
from drivers.scanner import DeviceError, Progress, SettingsError

PROGRESS = re.compile(r"progress\s+([0-9]*\.?[0-9]+)\s*(.*)")


def run(
    command: list[str],
    *,
    folder: Path,
    environment: Mapping[str, str],
    limit_s: float,
    progress: Progress,
    grace_s: float = 3.0,
    clock: Callable[[], float] = monotonic,
) -> str:
    """Run a program in a folder and wait for its end; return what it printed.

    Its lines `progress 0.4 projecting` are reported, the last one again and again, so that raising from `progress`
    cancels at any time. Whatever ends the wait ends the program and all that it started.
    grace_s: for it to end by itself, before it is killed.
    Raises SettingsError when it cannot be started, DeviceError when it fails or takes longer than the limit.
    """
    try:
        process = subprocess.Popen(
            command,
            cwd=folder,
            env={**os.environ, **environment},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
    except OSError as error:
        raise SettingsError(f"{command[0]} cannot be started: {error.strerror}", "check the command") from error
    with process:
        return run_parked(lambda: _followed(process, limit_s, progress, clock), [lambda: _end(process, grace_s)])


def _followed(process: subprocess.Popen[bytes], limit_s: float, progress: Progress, clock: Callable[[], float]) -> str:
    start, step, done, last = clock(), "capture", 0.0, b""
    printed = bytearray()
    with selectors.DefaultSelector() as selector:
        for stream in (process.stdout, process.stderr):
            assert stream is not None
            selector.register(stream, selectors.EVENT_READ)
        while (selector.get_map() and process.poll() is None) or _waiting(selector):
            for key, _ in selector.select(0.1):
                data = os.read(key.fd, 65536)
                if not data:
                    selector.unregister(key.fileobj)
                elif key.fileobj is process.stderr:
                    last = (last + data)[-2000:]
                else:
                    printed = (printed + data)[-65536:]
                    step, done = _latest(printed, step, done)
            progress(step, done)
            if clock() - start > limit_s:
                raise DeviceError(
                    f"the program took longer than {limit_s:g} s{_said(last)}",
                    "look at the scanner; raise timeout_s in [scanner] if it needs more",
                )
    code = process.wait()
    if code:
        reason = f"was ended by signal {-code}" if code < 0 else f"ended with code {code}"
        raise DeviceError(f"the program {reason}{_said(last)}", "look at the scanner and its program, then repeat")
    return printed.decode(errors="replace")


def _waiting(selector: selectors.BaseSelector) -> bool:
    """Whether a program that has ended left something to read.

    What it started may still hold the pipes.
    """
    return bool(selector.get_map() and selector.select(0))


def _latest(printed: bytearray, step: str, done: float) -> tuple[str, float]:
    """The last progress that was printed on a whole line."""
    for line in reversed(printed.decode(errors="replace").split("\n")[:-1]):
        if found := PROGRESS.fullmatch(line.strip()):
            return found[2] or step, min(float(found[1]), 1.0)
    return step, done


def _said(last: bytes) -> str:
    lines = [line.strip() for line in last.decode(errors="replace").splitlines() if line.strip()]
    return f": {'; '.join(lines[-5:])}" if lines else ""


def _end(process: subprocess.Popen[bytes], grace_s: float) -> None:
    """End a program that still runs, and all of its group: first by SIGTERM."""
    if process.poll() is None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            process.wait(grace_s)
    with suppress(ProcessLookupError):  # what it started and left
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
