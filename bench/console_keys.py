"""`python -m bench.console_keys [OPENING …]`: a volume worked through in the browser by the keyboard alone.

The simulated book, all fifteen openings or those that are named by their numbers, from an empty folder to BagIt, METS,
IIIF and PDF. Each opening is captured, captured again where it is red, split where the station asks, and accepted; the
spine of the fifth is moved. Prints the keys of each opening, and returns 1 where they are more than they may be.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from oracles.book import BOOK
from oracles.console.browser import chromium, window
from oracles.console.keyboard import deliver, work
from oracles.console.process import console_of

MOVED = 5  # the opening whose spine is moved
MOST = {"plain": 2, "spine": 8}  # keys of an opening that needs nothing, and of one whose spine is moved


def main(numbers: Sequence[int] = ()) -> int:
    """Print the figures."""
    numbers = numbers or [row.number for row in BOOK]
    print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    moved = {at for at, number in enumerate(numbers, 1) if number == MOVED}
    with ExitStack() as stack:
        console = stack.enter_context(console_of(Path(stack.enter_context(tempfile.TemporaryDirectory())), "book"))
        browser = stack.enter_context(chromium())
        page = stack.enter_context(window(browser, console.start(*map(str, numbers))))
        worked = work(page, "Book", len(numbers), moved)
        for one, number in zip(worked, numbers, strict=True):
            done = f"{one.what:<7} {one.keys} keys, {one.leaves} leaves, {one.seconds:4.0f} s"
            print(f"{number:>2}  {BOOK[number - 1].lies:<42} {done}", flush=True)
        print(f"delivered in four formats, each valid: {deliver(page)} keys")
    most = {what: max((one.keys for one in worked if one.what == what), default=0) for what in MOST}
    figures = f"at most {most['plain']} for an opening that needs nothing, {most['spine']} where the spine is moved"
    print(f"{sum(one.keys for one in worked) / sum(one.leaves for one in worked):.1f} keys a leaf; {figures}")
    return int(any(most[what] > MOST[what] for what in MOST))


if __name__ == "__main__":
    sys.exit(main([*map(int, sys.argv[1:])]))
