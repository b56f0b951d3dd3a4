"""First, do no harm: what a run must never overwrite."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

from restore import read_regular
from station.errors import OverwriteError
from station.export.atomic import refuse_existing

MAX_REPORT_BYTES = 2**24  # a page or two; more with many photographs
HINT = "choose another folder with -o"


def check_outputs(files: Sequence[Path], originals: Sequence[Path], *, force: bool) -> None:
    """Raise OverwriteError before the work when a file of the run would overwrite something it may not.

    An original is never written to. Without `force` nothing is overwritten. With it, in a folder that holds an
    original, only what an earlier run wrote: an OBJ's texture lies beside it, and an output may bear its name.
    files: what the run writes, all in one folder, the report last.
    """
    folder, report = files[-1].parent, files[-1]
    for original in originals:
        if original.is_dir() and folder.resolve().is_relative_to(original.resolve()):
            raise OverwriteError(f"{folder} is the original, which is never changed", HINT)
        for path in files:
            if _same(path, original):
                raise OverwriteError(f"{path} is the original, which is never overwritten", HINT)
    refuse_existing(files, force=force)
    if any(_same(folder, original.parent) for original in originals):
        _refuse_strange(files, _written_before(report))


def superseded(report: Path, possible: Sequence[Path], originals: Sequence[Path]) -> list[Path]:
    """The files that the run of a report wrote, of those that a run can write, but no original."""
    ours = _written_before(report)
    return [path for path in possible if path.name in ours and not any(_same(path, original) for original in originals)]


def _same(a: Path, b: Path) -> bool:
    return a.exists() and b.exists() and a.samefile(b)


def _refuse_strange(files: Sequence[Path], ours: frozenset[str]) -> None:
    for path in files:
        if os.path.lexists(path) and path.name not in ours:
            raise OverwriteError(f"{path} lies beside the original and no earlier run wrote it", HINT)


def _written_before(report: Path) -> frozenset[str]:
    """Names of the files that an earlier run wrote, as its report tells."""
    try:
        files = json.loads(read_regular(report, MAX_REPORT_BYTES))["files"]
        return frozenset(str(name) for name in files)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return frozenset()
