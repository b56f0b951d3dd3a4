"""Parking after work, whether the work succeeded or not."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager

from drivers.scanner import ScannerError


@contextmanager
def parked_on_exit(actions: Sequence[Callable[[], object]]) -> Iterator[None]:
    """Context manager that runs every action after the block, in order, even when the block or another action failed.

    An error of the block is raised with a note for each action that failed; otherwise the first error of the actions
    is raised.
    """
    faults: list[ScannerError] = []
    try:
        with ExitStack() as stack:
            for action in reversed(actions):
                stack.callback(_collecting, action, faults)
            yield
    except BaseException as error:
        for fault in faults:
            error.add_note(f"and the scanner could not be brought to rest: {fault}")
        raise
    if faults:
        raise faults[0]


def _collecting(action: Callable[[], object], faults: list[ScannerError]) -> None:
    try:
        action()
    except ScannerError as fault:
        faults.append(fault)
