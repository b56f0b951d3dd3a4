"""Which of the sheets in a scan a run restores, as `--sheets` says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from restore import BadInput, Finding, RangeScan, SurfaceMesh, separate_sheets
from restore.scan import ScannedSheet
from station.choices import Sheets


@dataclass(frozen=True, eq=False)
class Selected:
    """A sheet that a run restores.

    sheet          as it was found in the scan; None for a scan that is restored as a whole.
    suffix         of its results' stem.
    report_fields  that it adds to the report.
    """

    scan: RangeScan | SurfaceMesh
    sheet: ScannedSheet | None = None
    suffix: str = ""
    report_fields: Mapping[str, Any] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()


def select_sheets(scan: RangeScan | SurfaceMesh, pieces: Sheets) -> list[Selected]:
    """The sheets of a scan that are to be restored, left to right.

    Raises BadInput for a range image whose pieces are to be laid out TOGETHER, NotEnoughSurface without any surface.
    """
    is_mesh = isinstance(scan, SurfaceMesh)
    if pieces == Sheets.TOGETHER and is_mesh:
        return [Selected(scan)]
    sheets = separate_sheets(scan)
    if len(sheets) < 2:
        return [Selected(scan, sheet) for sheet in sheets]
    if pieces == Sheets.TOGETHER:
        raise BadInput(
            f"a range image of {len(sheets)} pieces cannot be packed in one image",
            "use --sheets separate or largest",
        )
    if pieces == Sheets.AUTO:
        if is_mesh and not all(sheet.is_rectangular for sheet in sheets):
            return [Selected(scan)]
        pieces = Sheets.SEPARATE if is_mesh else Sheets.LARGEST
    return [_largest(sheets)] if pieces == Sheets.LARGEST else _each(sheets)


def _largest(sheets: list[ScannedSheet]) -> Selected:
    *others, largest = sorted(sheets, key=lambda sheet: sheet.size)
    found = Finding.of("largest_of_pieces", others[-1].size / largest.size, count=len(sheets))
    return Selected(largest.scan, largest, findings=(found,))


def _each(sheets: list[ScannedSheet]) -> list[Selected]:
    count = len(sheets)
    return [
        Selected(sheet.scan, sheet, f"-{number}", {"sheet": {"number": number, "of": count}})
        for number, sheet in enumerate(sheets, start=1)
    ]
