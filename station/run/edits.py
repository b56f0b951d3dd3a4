"""Corrections by hand of a loose scan: the file next to it, or one that is named."""

from __future__ import annotations

import errno
import hashlib
from pathlib import Path

from restore import BadInput, PageEdits, parse_edits
from restore.files import read_regular
from station.choices import EDITS_SUFFIX
from station.errors import UsageError
from station.run.one_page import stem_of
from station.storage.atomic import refuse_existing, write_all
from station.storage.session_folder import refuse_session

MAX_BYTES = 2**16  # more than any corrections have; the format itself allows 48 KiB
CHUNK_BYTES = 2**20
NOT_THERE = (errno.ENOENT, errno.ENAMETOOLONG)  # no file can have a name that is too long


def edits_of(scan: Path, named: Path | None) -> PageEdits | None:
    """Return the corrections of a scan, None without.

    From the file that is named or `<stem>.edits.json` next to the scan. Raises BadInput for a file that cannot be read,
    is damaged, or belongs to another scan.
    """
    path = named or scan.parent / f"{stem_of(scan)}{EDITS_SUFFIX}"
    try:
        data = read_regular(path, MAX_BYTES)
    except (OSError, ValueError) as error:
        missing = isinstance(error, OSError) and error.errno in NOT_THERE
        if missing and named is None:
            return None
        if missing:
            raise BadInput(f"{path} does not exist", "check the name and the folder") from error
        reason = error.strerror if isinstance(error, OSError) else error
        raise BadInput(f"cannot read the corrections {path}: {reason}", "give a regular file with --edits") from error
    edits = parse_edits(data, str(path))
    if edits.scan is not None and scan.is_file() and edits.scan != digest_of(scan):
        raise BadInput(f"the corrections {path} were made on another scan", "make them again, or remove their key scan")
    return edits


def check_saved(edits: PageEdits | None, path: Path, *, force: bool) -> None:
    """Raise OverwriteError or UsageError where corrections cannot be written."""
    if edits is None:
        raise UsageError("--save-edits: the page has no corrections", "give some, as --outline, or leave it out")
    refuse_session(path)
    refuse_existing([path], force=force)


def save_edits(edits: PageEdits, scan: Path, path: Path, *, force: bool) -> None:
    """Write corrections that fit a scan, and no other one where it is a file.

    Raises OverwriteError, OSError.
    """
    fitting = edits.model_copy(update={"scan": digest_of(scan) if scan.is_file() else None})
    path = path.absolute()
    write_all([(path, fitting.canonical() + b"\n")], force=force)


def digest_of(scan: Path) -> str:
    """`sha512:…` of the main file of a scan."""
    digest = hashlib.sha512()
    with scan.open("rb") as file:
        while chunk := file.read(CHUNK_BYTES):
            digest.update(chunk)
    return f"sha512:{digest.hexdigest()}"
