"""Where a run writes and what, and what became of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from restore import Finding, Settings
from station.choices import Pieces, Turn
from station.export import outputs

Clock = Callable[[], float]


@dataclass(frozen=True)
class Destination:
    """Output folder and options of a run.

    kinds     those of `outputs.OUTPUTS` on top of the page and its report.
    language  of the words, as Tesseract calls it, when they are read.
    colours   ICC profile of the colour image, as `planish colour` writes it; None for sRGB.
    to_srgb   convert the page from that profile to sRGB; the master keeps codes and profile.
    pieces    what becomes of several sheets in one scan.
    turn      right angles by which the page is turned.
    anyway    write a page whose surface is no page's, too.
    """

    folder: Path
    kinds: frozenset[str] = frozenset()
    force: bool = False
    language: str = "eng"
    colours: bytes | None = None
    to_srgb: bool = False
    pieces: Pieces = Pieces.AUTO
    turn: Turn = Turn.NONE
    anyway: bool = False

    def files(self, stem: str, *, colour: bool = True) -> list[Path]:
        """The files that a run writes, the report last. colour: whether the scan has a colour image."""
        return [self.folder / name for name in outputs.names(stem, self.kinds, colour=colour)]

    def with_implied_outputs(self, settings: Settings) -> Destination:
        """The destination with the outputs that the settings imply: the master when light or colours
        change, the coverage when hidden places are filled."""
        changed = settings.shading == "remove" or settings.white != "keep" or self.to_srgb
        implied = {"master": changed, "coverage": settings.fill_hidden_mm > 0}
        return replace(self, kinds=self.kinds | {kind for kind, on in implied.items() if on})


@dataclass(frozen=True)
class Outcome:
    """The report of a run and the files written.

    pages  of several sheets in one scan, each by itself; the report lists theirs as `pieces`, and as `left_out` with
           the reason those that are no pages. Empty for one sheet.
    """

    report: Mapping[str, Any]
    files: tuple[Path, ...]
    pages: tuple[Outcome, ...] = ()


@dataclass(frozen=True)
class SourceRecord:
    """Steps before the restoration: their fields of the report, seconds of each stage, findings."""

    report_fields: Mapping[str, Any]
    seconds: Mapping[str, float]
    findings: tuple[Finding, ...] = ()
