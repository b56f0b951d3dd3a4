"""The sheets of a scan that become pages, by its layout: one page, or two leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from restore.findings import Finding
from restore.layout.crossing import REACH_MM
from restore.layout.decide import PRINT
from restore.layout.find import Inspected
from restore.layout.finding import Advice, LayoutFinding
from restore.layout.split import OVERLAP_MM, split_at_crease
from restore.prepared.separate import SeparateSheet
from restore.report import LeafReport

Layout = Literal["auto", "split", "whole", "left", "right"]


@dataclass(frozen=True, eq=False)
class Leaves:
    """The sheets of a scan that become pages.

    finding   its layout, as it was found.
    parts     `left`, `right` or `page` → the sheet, in this order.
    findings  what is to be reported of the layout.
    left_out  further sheets of the scan.
    """

    finding: LayoutFinding
    parts: Mapping[str, SeparateSheet]
    findings: tuple[Finding, ...] = ()
    left_out: tuple[SeparateSheet, ...] = ()

    def fields(self, part: str) -> LeafReport:
        """The fields of the report of a part."""
        return {"part": part, "layout": self.finding.as_json()}


def leaves_of(inspected: Inspected, layout: Layout, overlap_mm: float = OVERLAP_MM) -> Leaves:
    """Return the sheets that become pages of a scan with a known layout.

    layout, errors: as of `restore_leaves`.
    overlap_mm: of the facing page that a leaf keeps next to the spine.
    """
    finding = inspected.finding
    advice: Advice = finding.advice if layout == "auto" else layout
    if finding.gutter_hidden_mm:
        leaves: dict[str, SeparateSheet] = {sheet.part: sheet for sheet in inspected.sheets if sheet.part}
        if advice in ("whole", "split"):  # two sheets cannot be one page, and neither is lost
            notes = (Finding.of("gutter_hidden", width_mm=finding.gutter_hidden_mm),) if advice == "whole" else ()
            found = Leaves(finding, leaves, notes)
        else:
            found = Leaves(finding, {advice: leaves[advice]})
    elif advice in ("whole", "ask"):
        found = _whole(inspected, () if layout == "whole" else _notes(finding))
    else:
        found = _split(inspected, advice, overlap_mm)
    others = tuple(sheet for sheet in inspected.sheets if not sheet.part and len(inspected.sheets) > 1)
    largest = max(others, key=lambda sheet: sheet.size, default=None)
    return replace(found, left_out=tuple(sheet for sheet in others if finding.gutter_hidden_mm or sheet is not largest))


def _whole(inspected: Inspected, findings: tuple[Finding, ...]) -> Leaves:
    assert inspected.largest is not None
    return Leaves(inspected.finding, {"page": inspected.largest}, findings)


def _split(inspected: Inspected, advice: Advice, overlap_mm: float) -> Leaves:
    finding = inspected.finding
    crosses = finding.crossing is not None and finding.crossing > PRINT
    # Print that runs over the spine is whole on one of the leaves as far as it was looked for.
    overlap = max(overlap_mm, REACH_MM) if crosses else overlap_mm
    parts: Mapping[str, SeparateSheet] = split_at_crease(inspected, overlap)
    if advice != "split":
        strip = min(finding.widths_mm or (0.0,))
        return Leaves(finding, {advice: parts[advice]}, (Finding.of("facing_strip", width_mm=strip),))
    if not crosses:
        return Leaves(finding, parts)
    assert inspected.largest is not None
    found = Finding.of("print_cut", finding.crossing, overlap_mm=overlap)
    return Leaves(finding, {**parts, "page": inspected.largest}, (found,))


def _notes(finding: LayoutFinding) -> tuple[Finding, ...]:
    """What is to be reported of a scan that is restored whole."""
    if finding.advice == "ask":
        return (Finding.of("layout_unsure", reason=finding.reasons[0]),)
    if finding.is_spine != "no" and finding.crossing is not None and finding.crossing > PRINT:
        return (Finding.of("print_over_spine", finding.crossing),)
    return ()
