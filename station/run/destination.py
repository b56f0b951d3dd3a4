"""Where a run writes, and what became of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from restore import Finding, RestoredPage
from station.page_files import outputs
from station.run.options import RunOptions

Clock = Callable[[], float]


@dataclass(frozen=True)
class Destination:
    """Output folder of a run. force: replace what an earlier run wrote there."""

    folder: Path
    force: bool = False

    def files(self, stem: str, options: RunOptions, page: RestoredPage | None = None) -> list[Path]:
        """Return the files that a run writes, the report last.

        page: where it is known, only files that it has contents for.
        """
        return [self.folder / name for name in outputs.names(stem, options.outputs, page)]


@dataclass(frozen=True)
class Outcome:
    """Report of a run and the files written.

    pages: of several sheets in one scan, one each; the report lists theirs as `pieces`, and as `left_out` with the
        reason those that are not pages. Empty for one sheet.
    """

    report: Mapping[str, Any]
    files: tuple[Path, ...]
    pages: tuple[Outcome, ...] = ()


@dataclass(frozen=True)
class SourceRecord:
    """Steps before the restoration: fields of the report, seconds per stage, findings."""

    report_fields: Mapping[str, Any]
    seconds: Mapping[str, float]
    findings: tuple[Finding, ...] = ()
