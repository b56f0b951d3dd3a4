"""The command that finds the layout of a scan or a session, and writes nothing."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from station.commands.options import Debug, FileReading, Json, grouped, reading_options
from station.commands.sessions import Index, find_session
from station.commands.terminal import print_result, report_faults
from station.progress import progress_on

if TYPE_CHECKING:
    from station.session.leaves.layouts import PageLayout

ADVICE = {
    "split": "two leaves",
    "whole": "one page",
    "left": "the left leaf; the strip of the facing page is left out",
    "right": "the right leaf; the strip of the facing page is left out",
    "ask": "not clear: one page, until an operator decides",
}
ROW = "{:>5}  {:<6} {:<7} {:<16} {:<8} {}"
HEADING = ROW.format("page", "advice", "spine", "widths mm", "by hand", "reason")


@grouped
def layout(
    scan: Annotated[
        str, typer.Argument(metavar="SCAN|SESSION", help="A scan, as `planish restore` takes it, or a session.")
    ],
    reading: FileReading,
    texture: Annotated[Path | None, typer.Option(help="The colour image, where the scan has none.")] = None,
    index: Index = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Find the spine of opened books; writes nothing."""
    with report_faults(debug=debug), progress_on(sys.stderr) as progress:
        import json

        folder = _session_of(index, scan)
        if folder is None:
            finding = _finding(Path(scan), texture, reading)
            print_result(json.dumps(finding, indent=2) if as_json else "\n".join(_lines(finding)))
            return
        from station.session import read_session
        from station.session.leaves.layouts import layouts_of

        pages = list(layouts_of(read_session(folder), progress))
        if as_json:
            print_result(json.dumps([page.as_json() for page in pages], indent=2, ensure_ascii=False))
            return
        print_result("\n".join([HEADING, *map(_row, pages)]) if pages else "no pages")


def _session_of(index: Path | None, name: str) -> Path | None:
    """Return the folder of the session that a name is of, None for a scan."""
    from restore import BadInput
    from station.session.leaves.index import IndexUnusable
    from station.storage.session_folder import is_session

    path = Path(name)
    if is_session(path):
        return path
    if path.exists() or path.suffix:
        return None
    try:
        return find_session(index, name)
    except (BadInput, IndexUnusable):
        return None


def _finding(scan: Path, texture: Path | None, reading: FileReading) -> Mapping[str, Any]:
    """Return the layout of a scan as JSON values. Raises BadInput."""
    from restore import BadInput, find_layout, load_scan

    try:
        return find_layout(load_scan(scan, texture, **reading_options(reading))).as_json()
    except OSError as error:
        raise BadInput(f"cannot read {error.filename or scan}: {error.strerror}", "check the path") from error


def _lines(finding: Mapping[str, Any]) -> Iterator[str]:
    """Yield the finding for the operator."""
    yield f"layout     {finding['advice']}: {ADVICE[finding['advice']]}"
    yield f"spine      {finding['is_spine']}"
    if finding["widths_mm"] is not None and finding["sigma_mm"] is not None:
        left, right = finding["widths_mm"]
        yield f"place      {left:.1f} mm | {right:.1f} mm, ± {max(finding['sigma_mm'], 0.01):.2f} mm at least"
    if finding["crossing"] is not None:
        yield f"print      over the spine along {finding['crossing']:.1%} of its height"
    yield from (f"reason     {reason}" for reason in finding["reasons"])


def _row(page: PageLayout) -> str:
    """Return the line of a page of a session."""
    found = page.finding
    widths = found.get("widths_mm")
    place = "" if widths is None else f"{widths[0]:.1f} | {widths[1]:.1f}"
    reason = page.problem or next(iter(found.get("reasons", ())), "")
    cells = (str(page.page), found.get("advice", ""), found.get("is_spine", ""), place, page.by_hand, reason)
    return ROW.format(*cells).rstrip()
