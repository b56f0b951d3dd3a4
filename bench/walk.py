"""The way of one scan through the files of `restore`, counted by the calls themselves.

`python -m bench.walk` restores a FINE scan of a curled sheet twice and traces the second restoration: how many files
it enters, and how often a call goes from one file to another, by all threads. Calls of compiled kernels do not count.
"""

from __future__ import annotations

import sys
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import takewhile
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import restore
from drivers.simulated import Curl, shoot
from restore import Settings

ROOT = str(Path(restore.__file__).parent) + "/"
SEED = 5
MAX_SHOWN = 15


class Walk:
    """Calls between files of `restore`: (from, to) → number; from is empty where nothing of it called."""

    def __init__(self) -> None:
        self.crossings: Counter[tuple[str, str]] = Counter()
        self._names: dict[CodeType, str] = {}

    @property
    def files(self) -> set[str]:
        """The files that were entered."""
        return {entered for _, entered in self.crossings}

    def count(self, frame: FrameType, event: str, _argument: Any) -> None:
        """Count a call: a function for `sys.setprofile`."""
        if event != "call" or frame.f_back is None or not (entered := self._name(frame.f_code)):
            return  # numba gives the frame of a kernel no caller
        callers = (self._name(one.f_code) for one in _callers(frame))
        caller = next(filter(None, callers), "")
        if caller != entered:
            self.crossings[caller, entered] += 1

    def _name(self, code: CodeType) -> str:
        """The file of a code within `restore`, empty for others."""
        if code not in self._names:
            file = code.co_filename
            self._names[code] = file.removeprefix(ROOT) if file.startswith(ROOT) else ""
        return self._names[code]


def _callers(frame: FrameType) -> Iterator[FrameType]:
    one = frame.f_back
    while one is not None:
        yield one
        one = one.f_back


@contextmanager
def traced() -> Iterator[Walk]:
    """Count the calls of a block, in all threads."""
    walk = Walk()
    threading.setprofile(walk.count)
    sys.setprofile(walk.count)
    try:
        yield walk
    finally:
        sys.setprofile(None)
        threading.setprofile(None)  # type: ignore[arg-type]


def main() -> None:
    """Print the number of files and of crossings, and the files that are entered most often."""
    scan, _ = shoot(Curl(), seed=SEED)
    restore.restore(scan, Settings())
    with traced() as walk:
        restore.restore(scan, Settings())
    entered: Counter[str] = Counter()
    for (_, file), number in walk.crossings.items():
        entered[file] += number
    print(f"{len(walk.files)} files of restore, {sum(walk.crossings.values())} calls from one to another")
    for file, number in takewhile(lambda one: one[1] > 1, entered.most_common(MAX_SHOWN)):
        print(f"{number:6d}  {file}")


if __name__ == "__main__":
    main()
