"""Checks that a run overwrites no original and no foreign file.

Only files that an earlier run wrote may be replaced.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from itertools import count, takewhile
from pathlib import Path
from typing import Any

from restore.files import read_regular
from station.errors import OverwriteError
from station.page_files import outputs
from station.storage.atomic import refuse_existing

MAX_REPORT_BYTES = 2**24  # a page or two; more with many photographs
# A name that is free, or another kind of file than a run writes.
NO_REPORT = (errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ENXIO, errno.EINVAL, errno.EFBIG)
HINT = "choose another folder with -o"


def check_outputs(files: Sequence[Path], input_files: Sequence[Path], *, force: bool) -> None:
    """Raise OverwriteError before the work for a file that must stay.

    An original is never written to. Without `force` nothing is overwritten. With it, in a folder that holds an
    original, only what an earlier run wrote: an OBJ's texture is in the same folder, and an output may have its name.
    files: outputs of the run, all in one folder, the report last.
    input_files: the originals.
    """
    folder, report = files[-1].parent, files[-1]
    for original in input_files:
        if original.is_dir() and folder.resolve().is_relative_to(original.resolve()):
            raise OverwriteError(f"{folder} is the original, which is never changed", HINT)
    refuse_originals(files, input_files)
    refuse_existing(files, force=force)
    if any(_is_same_file(folder, original.parent) for original in input_files):
        _refuse_unreported(files, _reported_files(report))


def refuse_originals(files: Iterable[Path], input_files: Sequence[Path]) -> None:
    """Raise OverwriteError for the first file that is an input of the run.

    Also under another name or by a link.
    """
    for path in files:
        if any(_is_same_file(path, original) for original in input_files):
            raise OverwriteError(f"{path} is the original, which is never overwritten", HINT)


def superseded(report: Path, possible: Sequence[Path], input_files: Sequence[Path]) -> list[Path]:
    """The files of `possible` that the run of a report wrote, without the originals."""
    reported = _reported_files(report)
    return [
        path
        for path in possible
        if path.name in reported and not any(_is_same_file(path, original) for original in input_files)
    ]


def superseded_pieces(folder: Path, stem: str, scan: str, input_files: Sequence[Path]) -> list[Path]:
    """Return the files of an earlier run for sheets of the same scan.

    Those of `<stem>-1`, `<stem>-left` and so on. Results of another scan of such a name stay.
    scan: as its report names it.
    """

    def is_earlier(suffix: object) -> bool:
        content = _read_report(folder / f"{stem}-{suffix}.json")
        return content.get("scan") == scan and ("sheet" in content or "part" in content)

    sides = [side for side in ("left", "right") if is_earlier(side)]
    files: list[Path] = []
    for suffix in (*sides, *takewhile(is_earlier, count(1))):
        possible = [folder / name for name in outputs.names(f"{stem}-{suffix}", outputs.KINDS)]
        files += superseded(folder / f"{stem}-{suffix}.json", possible, input_files)
    return files


def _is_same_file(a: Path, b: Path) -> bool:
    return a.exists() and b.exists() and a.samefile(b)


def _refuse_unreported(files: Sequence[Path], reported: frozenset[str]) -> None:
    for path in files:
        if os.path.lexists(path) and path.name not in reported:
            raise OverwriteError(f"{path} lies next to the original and no earlier run wrote it", HINT)


def _reported_files(report: Path) -> frozenset[str]:
    """Return the files that an earlier run's report lists, empty without a readable one."""
    files = _read_report(report).get("files")
    return frozenset(str(name) for name in files) if isinstance(files, list) else frozenset()


def _read_report(path: Path) -> Mapping[str, Any]:
    """Return the report of an earlier run, empty without one.

    Raises OSError when the disk fails: without the report, files of that run would stay next to those of the new one.
    """
    try:
        content = json.loads(read_regular(path, MAX_REPORT_BYTES))
    except (ValueError, RecursionError):
        return {}
    except OSError as error:
        if error.errno in NO_REPORT:
            return {}
        raise
    return content if isinstance(content, dict) else {}
