"""Bringing everything to rest after work, whatever came of the work."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager

from drivers.scanner import ScannerError


@contextmanager
def at_rest(actions: Sequence[Callable[[], object]]) -> Iterator[None]:
    """Run the block, then every action in its order: each of them even when the block or another action failed.

    What the block raised stays what is raised, with a note for each action that failed; without it the first failed
    action's fault is raised.
    """
    faults: list[ScannerError] = []
    try:
        with ExitStack() as stack:
            for action in reversed(actions):
                stack.callback(_noting, action, faults)
            yield
    except BaseException as error:
        for fault in faults:
            error.add_note(f"and the scanner could not be brought to rest: {fault}")
        raise
    if faults:
        raise faults[0]


def _noting(action: Callable[[], object], faults: list[ScannerError]) -> None:
    try:
        action()
    except ScannerError as fault:
        faults.append(fault)
