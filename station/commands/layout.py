"""The command that finds the layout of a scan, and writes nothing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.commands.options import Debug, Json, Unit
from station.commands.terminal import print_result, report_faults

if TYPE_CHECKING:
    from restore import LayoutFinding

ADVICE = {
    "split": "two leaves",
    "whole": "one page",
    "left": "the left leaf; the strip of the facing page is left out",
    "right": "the right leaf; the strip of the facing page is left out",
    "ask": "not clear: one page, until an operator decides",
}


def layout(
    scan: Annotated[Path, typer.Argument(metavar="SCAN", help="A scan, as `planish restore` takes it.")],
    unit: Unit = "auto",
    texture: Annotated[Path | None, typer.Option(help="The colour image, where the scan has none.")] = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Find the spine of an opened book; writes nothing."""
    with report_faults(debug=debug):
        import json

        from restore import BadInput, find_layout, load_scan

        try:
            finding = find_layout(load_scan(scan, texture, unit=unit))
        except OSError as error:
            raise BadInput(f"cannot read {error.filename or scan}: {error.strerror}", "check the path") from error
        print_result(json.dumps(finding.as_json(), indent=2) if as_json else "\n".join(_lines(finding)))


def _lines(finding: LayoutFinding) -> list[str]:
    """The finding for the operator."""
    lines = [f"layout     {finding.advice}: {ADVICE[finding.advice]}", f"spine      {finding.is_spine}"]
    if finding.widths_mm is not None and finding.sigma_mm is not None:
        left, right = finding.widths_mm
        lines.append(f"place      {left:.1f} mm | {right:.1f} mm, ± {finding.sigma_mm:.2f} mm")
    if finding.crossing is not None:
        lines.append(f"print      over the spine along {finding.crossing:.1%} of its height")
    return [*lines, *(f"reason     {reason}" for reason in finding.reasons)]
