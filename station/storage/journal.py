"""Replace several files of a folder in one step, with an undo journal.

The files that will be replaced or removed are kept under a second name, the journal lists them, then the new files
take their places. Unlinking the journal commits. A run that finds a journal rolls back: the earlier files return,
and files that did not exist before are removed. Rolling back may itself be interrupted and started again.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from restore.files import read_regular
from station.errors import JournalDamaged
from station.storage.disk import sync_folder, write_file

JOURNAL = "journal.json"
NEW, OLD = "new", "old"
MAX_JOURNAL_BYTES = 2**20  # some dozens of names
# Disks and users that take no hard links; the file is then renamed, and absent for a moment.
NO_LINKS = {errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK}


@dataclass(frozen=True)
class Journal:
    """Names of files in the folder.

    Those to put in place, those to remove, and those of both that existed before.
    """

    put: list[str]
    removed: list[str]
    before: list[str]


def replace_files(folder: Path, work: Path, put: Sequence[str], removed: Sequence[str]) -> None:
    """Move the files `put` to `folder` and remove others: all or none.

    They are staged and flushed in work/new. Raises OSError when the disk refuses, after rolling back.
    """
    names = [*put, *removed]
    before = [name for name in names if os.path.lexists(folder / name)]
    sync_folder(work / NEW)
    try:
        (work / OLD).mkdir(exist_ok=True)
        _write(work, Journal(list(put), list(removed), before))
        for name in before:
            _keep(folder / name, work / OLD / name)
        sync_folder(work / OLD)
        for name in put:
            (work / NEW / name).replace(folder / name)
        for name in removed:
            (folder / name).unlink(missing_ok=True)
        sync_folder(folder)
        (work / JOURNAL).unlink()
    except BaseException:
        roll_back(folder, work)
        raise
    with suppress(OSError):  # the results stand; a power cut now may bring the journal back, and the earlier files
        sync_folder(work)


def roll_back(folder: Path, work: Path) -> None:
    """Restore the files from before an unfinished replacement, if there is a journal.

    Raises JournalDamaged, OSError when the disk refuses.
    """
    if not (work / JOURNAL).exists():
        return
    journal = _read(work)
    for name in [*journal.put, *journal.removed]:
        if os.path.lexists(work / OLD / name):
            (work / OLD / name).replace(folder / name)
        elif name not in journal.before:
            (folder / name).unlink(missing_ok=True)
    sync_folder(folder)
    (work / JOURNAL).unlink()


def _keep(path: Path, second: Path) -> None:
    """Give a file a second name, or rename it where the disk has no hard links."""
    try:
        second.hardlink_to(path) if not path.is_symlink() else path.rename(second)
    except OSError as error:
        if error.errno not in NO_LINKS:
            raise
        path.rename(second)


def _write(work: Path, journal: Journal) -> None:
    part = work / (JOURNAL + ".part")
    write_file(part, json.dumps(asdict(journal)).encode())
    part.replace(work / JOURNAL)
    sync_folder(work)


def _read(work: Path) -> Journal:
    try:
        journal = Journal(**json.loads(read_regular(work / JOURNAL, MAX_JOURNAL_BYTES)))
        names = [*journal.put, *journal.removed, *journal.before]
        if any(Path(name).name != name for name in names):
            raise ValueError("a name leaves the folder")
    except (ValueError, TypeError, RecursionError) as error:
        raise JournalDamaged(work, str(error)) from error
    return journal
