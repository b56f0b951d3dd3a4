"""Which of the sheets in a scan a run restores, as `--sheets` says."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal

from restore import (
    BadInput,
    Finding,
    RangeScan,
    RestoredPage,
    Settings,
    SurfaceMesh,
    restore_leaves,
    separate_sheets,
)
from restore.scan import ScannedSheet
from station.choices import Layout, Sheets
from station.run.options import RunOptions

# of the size of the page: what is left out may be the other half of the page, or another page as important
LARGE = 0.5
LAYOUTS: Mapping[Layout, Literal["auto", "split", "whole"]] = {
    Layout.AUTO: "auto",
    Layout.SPLIT: "split",
    Layout.WHOLE: "whole",
}


@dataclass(frozen=True, eq=False)
class Selected:
    """A sheet that a run restores.

    sheet          as it was found in the scan; None for a scan that is restored as a whole.
    suffix         of its results' stem.
    report_fields  that it adds to the report.
    settings       of its page; None for those of the run.
    restored       restores its page, as `restore` does; None for `restore` itself.
    """

    scan: RangeScan | SurfaceMesh
    sheet: ScannedSheet | None = None
    suffix: str = ""
    report_fields: Mapping[str, Any] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    settings: Settings | None = None
    restored: Callable[..., RestoredPage] | None = None


def select_sheets(scan: RangeScan | SurfaceMesh, pieces: Sheets, *, both_leaves: bool = False) -> list[Selected]:
    """Return the sheets of a scan that are to be restored, left to right.

    both_leaves: whether the leaves of a gutter without range are two pages, whatever `pieces` says.
    Raises BadInput for a range image whose pieces are to be arranged TOGETHER, NotEnoughSurface without any surface.
    """
    is_mesh = isinstance(scan, SurfaceMesh)
    if pieces == Sheets.TOGETHER and is_mesh:
        return [Selected(scan)]
    sheets = separate_sheets(scan)
    if len(sheets) < 2:
        return [Selected(scan, sheet) for sheet in sheets]
    if both_leaves and any(sheet.part for sheet in sheets):
        return _leaves(sheets)
    if pieces == Sheets.TOGETHER:
        raise BadInput(
            f"a range image of {len(sheets)} pieces cannot be packed in one image",
            "use --sheets separate or largest",
        )
    if pieces == Sheets.AUTO:
        if is_mesh and not all(sheet.is_rectangular for sheet in sheets):
            return [Selected(scan)]
        if any(sheet.part for sheet in sheets):
            return _leaves(sheets)
        pieces = Sheets.SEPARATE if is_mesh else Sheets.LARGEST
    return [_largest(sheets)] if pieces == Sheets.LARGEST else _each(sheets)


def select_leaves(scan: RangeScan | SurfaceMesh, options: RunOptions) -> list[Selected]:
    """Return the leaves of an opened book, or the page of any other scan.

    By the layout of the options, corrected by hand where they have edits. Raises NotEnoughSurface without any surface,
    BadInput for a split without a valley and edits that do not fit.
    """
    layout = LAYOUTS[options.layout] if options.edits is None else "auto"  # corrections name their own layout
    restored = restore_leaves(scan, options.settings, layout=layout, edits=options.edits, kept=options.kept)
    leaves = restored.found
    sizes = [sheet.size for sheet in leaves.parts.values()]
    others = [sheet for sheet in leaves.left_out if not sheet.part]
    found = leaves.findings + (_left_out(others, max(sizes), len(others) + 1) if others else ())
    return [
        Selected(
            sheet.scan,
            sheet,
            "" if len(sizes) == 1 or part == "page" else f"-{part}",
            leaves.fields(part),
            found,
            restored.settings_of(part),
            partial(restored.page, part),
        )
        for part, sheet in leaves.parts.items()
    ]


def _largest(sheets: list[ScannedSheet]) -> Selected:
    *others, largest = sorted(sheets, key=lambda sheet: sheet.size)
    return Selected(largest.scan, largest, findings=_left_out(others, largest.size, len(sheets)))


def _leaves(sheets: list[ScannedSheet]) -> list[Selected]:
    """The two leaves of an opened book, each as a page."""
    leaves = [sheet for sheet in sheets if sheet.part]
    others = [sheet for sheet in sheets if not sheet.part]
    found = _left_out(others, max(leaf.size for leaf in leaves), len(sheets)) if others else ()
    return [
        Selected(
            leaf.scan,
            leaf,
            f"-{leaf.part}",
            {name: getattr(leaf, name) for name in ("part", "gutter_hidden_mm")},
            found,
        )
        for leaf in leaves
    ]


def _left_out(others: Sequence[ScannedSheet], size: float, count: int) -> tuple[Finding, ...]:
    """The finding of sheets that are not restored; size: of the page, in their unit."""
    fraction = max(sheet.size for sheet in others) / size
    if fraction < LARGE:
        return (Finding.of("largest_of_pieces", fraction, count=count),)
    return (Finding.of("large_sheet_left_out", fraction, count=count),)


def _each(sheets: list[ScannedSheet]) -> list[Selected]:
    count = len(sheets)
    return [
        Selected(sheet.scan, sheet, f"-{number}", {"sheet": {"number": number, "of": count}})
        for number, sheet in enumerate(sheets, start=1)
    ]
