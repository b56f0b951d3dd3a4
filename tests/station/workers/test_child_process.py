"""The process of pages by itself: what it answers, and how it ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from station.workers.child import INTERRUPTED
from tests.station.workers import work


@contextmanager
def child(scratch: Path) -> Iterator[tuple[subprocess.Popen, Connection, int]]:
    """The process, the connection to it, and the end of the lifeline that keeps it alive."""
    ours, theirs = Pipe()
    life, lifeline = os.pipe()
    words = [sys.executable, "-m", "station.workers.child", str(theirs.fileno()), str(life), "0", str(scratch)]
    process = subprocess.Popen(words, pass_fds=(theirs.fileno(), life))
    theirs.close()
    os.close(life)
    try:
        yield process, ours, lifeline
    finally:
        with suppress(OSError):
            os.close(lifeline)
        ours.close()
        process.wait()


@pytest.fixture
def scratch(tmp_path) -> Path:
    (tmp_path / "scratch").mkdir()
    return tmp_path / "scratch"


def test_it_answers_one_call_after_the_other(scratch) -> None:
    with child(scratch) as (_, connection, _):
        for number in range(3):
            connection.send((work.double, (number, ())))
            assert connection.recv() == ("value", 2 * number)
        connection.send((work.refuse, (None, ())))
        kind, fault = connection.recv()
        assert (kind, fault.exit_code, fault.hints) == ("fault", 3, ("scan again", "the scan is safe"))


@pytest.mark.parametrize("how", ["lifeline", "SIGTERM"])
def test_it_ends_in_order_and_its_folder_goes(scratch, how) -> None:
    with child(scratch) as (process, connection, lifeline):
        connection.send((work.double, (1, ())))
        connection.recv()
        if how == "lifeline":
            os.close(lifeline)
        else:
            process.send_signal(signal.SIGTERM)
        assert process.wait() == INTERRUPTED
    assert not scratch.exists()
