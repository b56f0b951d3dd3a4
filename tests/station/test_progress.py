"""Bars on a terminal, silence elsewhere."""

from __future__ import annotations

import io
import os
import pty
import threading

import numba

from station.progress import progress_on, silent


def test_progress_is_silent_without_a_terminal():
    stream = io.StringIO()
    with progress_on(stream) as progress:
        assert progress is silent
        progress("flatten", 0.5)
    assert stream.getvalue() == ""


def test_bars_on_a_terminal(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    read, write = pty.openpty()
    shown = []
    reader = threading.Thread(target=lambda: shown.append(drain(read)))
    reader.start()
    with os.fdopen(write, "w") as terminal, progress_on(terminal) as progress:
        progress("flatten", 0.25)
        progress("flatten", 1.0)
        progress("texture", 1.0)
    reader.join()
    os.close(read)
    assert "flatten" in shown[0]
    assert "texture" in shown[0]
    assert "100%" in shown[0]


def test_a_stage_that_waits_for_kernels_says_so(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    read, write = pty.openpty()
    shown = []
    reader = threading.Thread(target=lambda: shown.append(drain(read)))
    reader.start()
    with os.fdopen(write, "w") as terminal, progress_on(terminal) as progress:
        progress("prepare", 1.0)
        progress("flatten", 0.0)
        numba.njit(lambda x: x + 1)(1)
        progress("texture", 0.0)
    reader.join()
    os.close(read)
    assert "flatten: compiling, once" in shown[0]
    assert "prepare: compiling" not in shown[0]
    assert "texture: compiling" not in shown[0]


def drain(terminal: int) -> str:
    """Everything until the other end is closed."""
    data = b""
    try:
        while more := os.read(terminal, 4096):
            data += more
    except OSError:  # how Linux tells of a terminal whose other end is closed
        pass
    return data.decode()
