"""Parking after work: the scanner is left safe, without interruption."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from drivers.safety.signals import SignalGuard
from drivers.scanner import ScannerError

Result = TypeVar("Result")
Action = Callable[[], object]


def run_parked(work: Callable[[], Result], actions: Sequence[Action]) -> Result:
    """Do the work, then every action in order, even after a failure.

    Returns the work's result.
    From the end of the work on, ending signals (Ctrl-C, SIGTERM, SIGHUP) are held back; of several during the work only
    the first interrupts it. An error of the work is raised with a note for each action that failed; otherwise the first
    error of the actions is raised.
    """
    faults: list[Exception] = []
    parked = False
    with SignalGuard() as signals:
        try:
            try:
                result = work()
            finally:
                signals.hold()
                faults, parked = _failures(actions), True
        except BaseException as error:
            if not parked:  # a signal came between the end of the work and `hold`: no second one can
                signals.hold()
                faults = _failures(actions)
            for fault in faults:
                error.add_note(f"and the scanner could not be brought to rest: {fault}")
                _copy_notes(fault, error)
            raise
        if faults:
            raise faults[0]
        return result


def _failures(actions: Sequence[Action]) -> list[Exception]:
    """The errors of the actions, each of which is run."""
    faults: list[Exception] = []
    for action in actions:
        try:
            action()
        except Exception as fault:  # of any kind: the other actions come first
            faults.append(fault)
    return sorted(faults, key=lambda fault: isinstance(fault, ScannerError), reverse=True)


def _copy_notes(fault: BaseException, error: BaseException) -> None:
    for note in getattr(fault, "__notes__", ()):
        error.add_note(note)
