"""Exchange the corrections of a page with a file that fits its scan."""

from __future__ import annotations

from pathlib import Path

from restore import BadInput, PageEdits, parse_edits
from station.run.edits import MAX_BYTES, digest_of
from station.session.captures.scans import scan_path
from station.session.corrections.layers import resolved_edits
from station.session.log.history import CapturedPage
from station.session.log.store import Session
from station.storage.atomic import lock_output_folder, refuse_existing, write_all
from station.storage.given_file import read_given
from station.storage.session_folder import refuse_session

SCAN = "sha512:"


def export_edits(session: Session, page: CapturedPage, path: Path, *, force: bool = False) -> None:
    """Write all corrections of a page, with those of rules, to a file that fits its scan.

    `planish restore` of the scan with this file gives the page that the session has.
    Raises OverwriteError, UsageError for a file in a session, OSError.
    """
    refuse_session(path)
    refuse_existing([path], force=force)
    edits = resolved_edits(session, page)
    edits = edits.model_copy(update={"scan": _digests(session, page)[0]})
    with lock_output_folder(path.absolute().parent) as lock:
        write_all([(path.absolute(), edits.canonical() + b"\n")], force=force, lock=lock)


def import_edits(
    session: Session, page: CapturedPage, path: Path, *, of_another: bool = False
) -> tuple[PageEdits, dict[str, str]]:
    """Read corrections from a file, and return them with the labels of their parts.

    of_another: whether they may have been made on another scan.
    Raises BadInput for a file that is damaged, or of another scan.
    """
    data = read_given(path, MAX_BYTES, f"the corrections {path}", "give a regular file")
    edits = parse_edits(data, str(path))
    if edits.scan is not None and not of_another and edits.scan not in _digests(session, page):
        raise BadInput(f"the corrections {path} were made on another scan", "insist with --edits-of-another")
    labels: dict[str, str] = {name: part.label for name, part in edits.parts.items() if part.label}
    return edits.dropped("scan", "format", "version", "frame", "label"), labels


def _digests(session: Session, page: CapturedPage) -> list[str]:
    """Return the digests of a scan: of its main file, and of its record."""
    scan = scan_path(session, page.capture)
    return [*([digest_of(scan)] if scan.is_file() else []), SCAN + page.capture.sha512]
