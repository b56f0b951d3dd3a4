"""`repair`: restores what can be had again.

What it replaces goes to a folder next to the session.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from restore import RestoreError
from station.errors import StationError
from station.session.derivation.reproduce import Derive, derive
from station.session.fixity.verify import Inspection, Problem, verify
from station.session.log import bag
from station.session.log.events import RECORD
from station.session.log.history import folded
from station.session.log.store import READ_ONLY, Session, file_digest
from station.storage.disk import sync_folder, sync_tree
from station.storage.folder_lock import FolderLock, lock_folder

ASIDE = "{name}.set-aside"


@dataclass(frozen=True)
class Repaired:
    """What was done about a problem.

    how: empty when nothing could be done, with the reason in `why_not`.
    """

    problem: Problem
    how: str
    why_not: str = ""


def repair(
    folder: Path, *, copy: Path | None = None, workers: int | None = None, derivers: dict[str, Derive] | None = None
) -> list[Repaired]:
    """Repair what `verify` finds.

    copy: another copy of the session, whole or not, from which files are taken by their digests.
    Returns what was done about each problem, in its order. Raises BadInput when the folder is not a session,
    FolderInUse, OSError when the disk refuses.
    """
    inspection = verify(folder, workers=workers)
    if not inspection.problems:
        return []
    with lock_folder(folder) as lock:
        return _Repair(lock, inspection, copy, derivers).run()


class _Repair:
    """One repair of a locked session."""

    def __init__(
        self, lock: FolderLock, inspection: Inspection, copy: Path | None, derivers: dict[str, Derive] | None
    ) -> None:
        self._folder_lock, self._folder, self._copy, self._derivers = lock, lock.folder, copy, derivers
        self._found, self._reconciled = dict(inspection.found), inspection.reconciled
        self._problems = inspection.problems
        self._expected, self._tags = self._reconciled.expected(), self._reconciled.tag_files()
        self._aside = free_name(self._folder)
        lock.new.mkdir(exist_ok=True)

    def run(self) -> list[Repaired]:
        """Repair renamed and listed files first.

        Derivatives are derived from them.
        """
        done = dict[Problem, Repaired]()
        for problem in sorted(self._problems, key=_urgency):
            done[problem] = self._repaired(problem)
        return [done[problem] for problem in self._problems]

    def _repaired(self, problem: Problem) -> Repaired:
        try:
            for way, how in self._ways(problem):
                if way():
                    return Repaired(problem, how)
        except (RestoreError, StationError) as error:
            return Repaired(problem, "", str(error))
        return Repaired(problem, "", "no whole copy of it was found" if self._copy else "only a copy can have it")

    def _ways(self, problem: Problem) -> Iterator[tuple[Callable[[], bool], str]]:
        path = problem.path
        if problem.kind == "extra":
            yield lambda: self._set_aside(path), f"set aside in {self._aside}"
        elif problem.kind == "renamed":
            yield lambda: self._put_back(problem), "put back"
        elif path in self._tags or path.endswith(f"/{RECORD}"):
            yield lambda: self._from_records(path), "written from the other records"
        elif problem.kind == "unfinished":
            yield self._finish, "completed"
        elif path in self._expected:
            yield lambda: self._from_equal_file(path), "copied from an equal file"
            yield lambda: self._from_copy(path), "taken from the copy"
            yield lambda: self._derived(path), "derived again, to the byte"

    def _set_aside(self, path: str) -> bool:
        target = self._aside / path
        target.parent.mkdir(parents=True, exist_ok=True)
        (self._folder / path).rename(target)
        self._remove_empty((self._folder / path).parent)
        sync_folder(target.parent)
        return True

    def _put_back(self, problem: Problem) -> bool:
        source, target = self._folder / problem.moved_to, self._folder / problem.path
        target.parent.mkdir(parents=True, exist_ok=True)
        source.rename(target)
        sync_folder(target.parent)
        self._remove_empty(source.parent)
        self._found[problem.path] = self._found.pop(problem.moved_to)
        return True

    def _from_records(self, path: str) -> bool:
        data = self._tags.get(path)
        if data is None:
            number = int(path.split("/")[1].split("-")[1])
            data = self._reconciled.events[number].line
        return self._place(path, data)

    def _finish(self) -> bool:
        return all(self._place(name, self._tags[name]) for name in (*bag.GROWING, bag.TAG_MANIFEST))

    def _from_equal_file(self, path: str) -> bool:
        digest = self._expected[path]
        equal = next((other for other, known in self._found.items() if known == digest and other != path), None)
        return equal is not None and self._place_file(path, self._folder / equal)

    def _from_copy(self, path: str) -> bool:
        return self._copy is not None and (self._copy / path).is_file() and self._place_file(path, self._copy / path)

    def _derived(self, path: str) -> bool:
        """Derive the event that a file belongs to.

        Every file of it that came out to the byte is put in place.
        """
        event = self._reconciled.events[int(path.split("/")[1].split("-")[1])]
        if event.kind != "stage":
            return False
        events = [self._reconciled.events[number] for number in sorted(self._reconciled.events)]
        scratch = self._folder_lock.work / "derived"
        shutil.rmtree(scratch, ignore_errors=True)
        try:
            derive(Session(self._folder, folded(events)), event, scratch, derivers=self._derivers)
            name = path.split("/", 2)[2]
            if not (scratch / name).is_file() or file_digest(scratch / name) != self._expected[path]:
                raise StationError(f"{event.software} wrote another {name} than this program does")
            return self._place_file(path, scratch / name)
        finally:
            shutil.rmtree(scratch, ignore_errors=True)

    def _place_file(self, path: str, source: Path) -> bool:
        data = source.read_bytes()
        return bag.sha512(data) == self._expected[path] and self._place(path, data)

    def _place(self, path: str, data: bytes) -> bool:
        """Put a file in its place, flushed; what stands there goes aside."""
        staged, target = self._folder_lock.new / "mended", self._folder / path
        staged.unlink(missing_ok=True)
        staged.write_bytes(data)
        if path not in self._tags:
            staged.chmod(READ_ONLY)
        sync_tree(self._folder_lock.new)
        target.parent.mkdir(parents=True, exist_ok=True)
        if os.path.lexists(target) and path not in self._tags:
            self._keep_damaged(path)
        staged.replace(target)
        sync_folder(target.parent)
        self._found[path] = bag.sha512(data)
        return True

    def _keep_damaged(self, path: str) -> None:
        kept = self._aside / path
        kept.parent.mkdir(parents=True, exist_ok=True)
        (self._folder / path).rename(kept)

    def _remove_empty(self, folder: Path) -> None:
        while (
            folder not in (self._folder, self._folder / bag.PAYLOAD) and folder.is_dir() and not any(folder.iterdir())
        ):
            folder.rmdir()
            folder = folder.parent


def _urgency(problem: Problem) -> int:
    """Return the order of repair.

    Files in the wrong place, records, then captures and what is derived from them.
    """
    order = ("renamed", "extra", "unfinished", "contradiction", "missing", "damaged")
    return order.index(problem.kind) + 10 * (problem.remedy.startswith("planish repair derives"))


def free_name(folder: Path) -> Path:
    """Return a new folder next to the session for replaced files.

    It does not exist yet.
    """
    base = folder.with_name(ASIDE.format(name=folder.name))
    return next(
        path
        for number in count(1)
        if not os.path.lexists(path := base if number == 1 else base.with_name(f"{base.name}-{number}"))
    )
