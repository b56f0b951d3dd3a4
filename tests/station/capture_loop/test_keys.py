"""Keys of a pipe and a foot-switch on a loop-back line."""

from __future__ import annotations

import io
import os
import pty
from queue import SimpleQueue

import pytest

from station.capture_loop import keys
from station.errors import UsageError


def test_a_pipe_gives_its_characters_then_its_end():
    got: SimpleQueue[str] = SimpleQueue()
    keys.read_keys(io.StringIO(" \nq"), got.put).join()
    assert [keys.ACTIONS.get(got.get()) for _ in range(4)] == ["capture", "accept", "quit", "quit"]


def test_a_terminal_gives_single_keys_and_is_put_back():
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "r") as stream, os.fdopen(ours, "wb", buffering=0) as operator:
        before = keys.termios.tcgetattr(stream.fileno())
        with keys.single_strokes(stream):
            operator.write(b" ")
            assert stream.read(1) == " "  # without an enter
        assert keys.termios.tcgetattr(stream.fileno()) == before


def test_a_press_of_the_foot_switch_is_one_whatever_it_sends(monkeypatch):
    ours, theirs = pty.openpty()
    presses: SimpleQueue[str] = SimpleQueue()
    with keys.foot_switch(os.ttyname(theirs), lambda: presses.put("press")):
        os.write(ours, b"\x01\x02\x03")
        assert presses.get(timeout=10) == "press"
        os.write(ours, b"x")
        assert presses.get(timeout=10) == "press"
        assert presses.empty()
    os.close(ours)
    os.close(theirs)


def test_without_a_switch_nothing_is_opened():
    with keys.foot_switch(None, lambda: None):
        pass


def test_a_port_that_is_not_there():
    with pytest.raises(UsageError, match="foot-switch"), keys.foot_switch("/dev/gone", lambda: None):
        pass
