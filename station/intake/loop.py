"""The watch of a folder.

It lists the folder, waits until a scan is complete, then restores or quarantines it, once.
"""

from __future__ import annotations

import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Literal

from restore.runtime import LibraryMissing
from station.errors import StationError, UsageError, explain
from station.intake import records
from station.intake.arrival import OF_A_NAME, PASSING, Arrival, Changed
from station.intake.companions import Pairing, is_scan
from station.intake.folders import batch_instead, check_folders
from station.intake.listing import Quiet, Stamp, has_writer, list_files
from station.intake.once import Restore, restore_once
from station.intake.presets import Presets
from station.storage.atomic import lock_output_folder
from station.storage.folder_lock import FolderLock

POLL_S = 1.0
SETTLE_S = 3.0  # without a change: copying programs write several times a second, over a slow network every other one
PAIR_S = 30.0  # for files that belong to a scan: programs write them one after the other

STAGED = "arrival"

Event = Literal["restored", "set aside", "waiting", "left out"]
State = Literal["done", "worked", "waiting"]
Notify = Callable[[Event, Path, str], None]
"""Called with what happened, the scan, and where the result is, or why it is missing.

The scan is relative to the watched folder.

A session is left out: its scans are those of its own record.
"""


@dataclass(frozen=True)
class Pace:
    """Pace of a watch, seconds.

    How often to look, how long a file must not change, how long to wait for files that belong to it.
    """

    poll_s: float = POLL_S
    settle_s: float = SETTLE_S
    pair_s: float = PAIR_S


@dataclass
class Watch:
    """The watch over a folder.

    folder, out  watched folder and folder of the results, absolute.
    once         whether to end when nothing is left to wait for.
    counts       how many scans were restored and set aside by this watch.
    """

    folder: Path
    out: Path
    presets: Presets
    restore: Restore
    notify: Notify
    pace: Pace = Pace()
    once: bool = False
    clock: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep
    now: Callable[[], datetime] = records.utc
    counts: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self._quiet, self._pairing = Quiet(self.clock), Pairing(self.folder)
        self._done: dict[Path, tuple[Stamp, ...]] = {}
        self._reasons: dict[Path, str] = {}

    def run(self) -> None:
        """Watch until interrupted, or with `once` until nothing is left to wait for.

        Raises UsageError when the folders cannot be, FolderInUse when another run writes to the results, OSError when
        the disk refuses, LibraryMissing.
        """
        check_folders(self.folder, self.out)
        with lock_output_folder(self.out):
            while True:
                states = self.poll()
                if "worked" in states:
                    continue
                if self.once and "waiting" not in states:
                    return
                self.sleep(self.pace.poll_s)

    def poll(self) -> set[State]:
        """List the folder, and restore or quarantine the first ready scan.

        Returns the states of the scans.
        """
        try:
            listing = list_files(self.folder, without=self.out, left_out=self._leave_out)
        except OSError as error:  # a network share that is gone for a while
            self._wait(Path(), UsageError(f"{self.folder} cannot be read: {error.strerror}"))
            return {"waiting"}
        self._reasons.pop(Path(), None)
        self._quiet.update(listing)
        self._pairing.update(listing)
        self.presets.update(listing)
        self._done = {path: stamps for path, stamps in self._done.items() if path in listing}
        states = set[State]()
        for source in filter(is_scan, listing):
            states.add(self._look_at(source))
            if "worked" in states:  # which took its time: what is listed may have changed
                break
        return states

    def _look_at(self, source: Path) -> State:
        if self._quiet.seconds(source) < self.pace.settle_s:
            return "waiting"
        try:
            arrival, missing = self._arrival(source)
            if self._done.get(source) == arrival.stamps:
                return "done"
            state = self._do(arrival) if self._is_complete(arrival, missing=missing) else "waiting"
        except (Changed, FileNotFoundError):
            return "waiting"
        except OSError as error:
            if error.errno in OF_A_NAME:
                return self._give_up(source, error)
            if error.errno not in PASSING:
                raise
            self._wait(source, UsageError(f"cannot be read just now: {error.strerror}"))
            return "waiting"
        except (StationError, LibraryMissing):
            raise
        except Exception as error:
            return self._give_up(source, error)
        if state != "waiting":
            self._done[source] = arrival.stamps
            self._reasons.pop(source, None)
        return state

    def _give_up(self, source: Path, error: Exception) -> State:
        """Notify, once, of a scan that cannot even be looked at, nor a note of it be written."""
        reason = explain(error).message
        if self._reasons.get(source) != reason:
            self._reasons[source] = reason
            self.counts["set aside"] += 1
            self.notify("set aside", source, reason)
        return "done"

    def _arrival(self, source: Path) -> tuple[Arrival, bool]:
        """The scan with its companions, and whether some of them are missing. Raises OSError."""
        try:
            companions = self._pairing.companions(source)
        except PermissionError:  # which `_do` meets again, and sets aside
            return Arrival.of(self.folder, source, {}, self._quiet.listing), False
        return Arrival.of(self.folder, source, companions.found, self._quiet.listing), companions.missing

    def _is_complete(self, arrival: Arrival, *, missing: bool) -> bool:
        quiet = min(map(self._quiet.seconds, arrival.files.values()))
        if quiet < self.pace.settle_s or (missing and quiet < self.pace.pair_s):
            return False
        return not any(has_writer(arrival.folder / path) for path in arrival.files.values())

    def _do(self, arrival: Arrival) -> State:
        """Restore a scan or set it aside, unless that was done. Raises Changed, OSError."""
        if records.find_result(self.out, arrival):
            records.end_attempt(self.out, arrival)
            return "done"
        try:
            options = self.presets.options(arrival.source.parent)
        except UsageError as error:
            self._wait(arrival.source, error)
            return "waiting"
        with staging(self.out) as staged:
            settled = restore_once(arrival, self.out, options, staged, self.restore, now=self.now)
        if settled.state == "done":
            return "done"
        self.counts[settled.state] += 1
        reason = f"{settled.reason} ({settled.place})" if settled.reason else str(settled.place)
        self.notify(settled.state, arrival.source, reason)
        return "worked"

    def _leave_out(self, session: Path) -> None:
        """Notify, once, of a session in the folder."""
        if session not in self._reasons:
            self._reasons[session] = batch_instead(self.folder / session)
            self.notify("left out", session, self._reasons[session])

    def _wait(self, path: Path, error: UsageError) -> None:
        """Notify, once, of what the operator has to repair.

        Raises the error with `once`: no one would wait for that.
        """
        if self.once:
            raise error
        text = f"{error} ({error.hint})" if error.hint else str(error)
        if self._reasons.get(path) != text:
            self._reasons[path] = text
            self.notify("waiting", path, text)


@contextmanager
def staging(out: Path) -> Iterator[Path]:
    """Yield an empty folder in the hidden one of a locked folder.

    On the same disk; it is removed at the end of the block.
    """
    staged = FolderLock(out).new / STAGED
    shutil.rmtree(staged, ignore_errors=True)
    try:
        yield staged
    finally:
        shutil.rmtree(staged, ignore_errors=True)
