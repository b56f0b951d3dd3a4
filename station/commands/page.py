"""The commands that capture a page or take a stored one, and restore it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.commands.by_hand import ByHand
from station.commands.options import Config, Kinds, Out, Pictures, Reading, Restoration, Run, grouped, run_options
from station.commands.terminal import print_result, report_faults
from station.progress import progress_on

if TYPE_CHECKING:
    from station.run.destination import Outcome


@grouped
def scan(
    config: Config,
    output: Out,
    kinds: Kinds,
    run: Run,
    average: Annotated[
        int | None, typer.Option(min=1, max=64, help="Captures to average.", show_default="as configured")
    ] = None,
    views: Annotated[int | None, typer.Option(min=2, max=72, help="Views to capture on the turntable.")] = None,
    shots: Annotated[
        int | None,
        typer.Option(
            "--super-resolution",
            min=4,
            max=64,
            help="Captures for super-resolution; move the page half a pixel between.",
        ),
    ] = None,
) -> None:
    """Capture a page with the scanner, store and restore it."""
    with report_faults(debug=run.debug), progress_on(sys.stderr) as progress:
        from station.config import load_config
        from station.run.destination import Destination
        from station.run.one_page import scan_page
        from station.run.turntable import scan_views

        station = load_config(config)
        if average is not None:
            station = station.model_copy(update={"capture": replace(station.capture, average=average)})
        destination = Destination(output, run.force)
        options = run_options(
            "scan", replace(kinds, review=True), Restoration(), rotate=run.rotate, allow_distorted=run.allow_distorted
        )
        if views is None:
            outcome = scan_page(station, destination, options, shots=shots or 1, progress=progress)
        else:
            outcome = scan_views(station, destination, options, turns=views, progress=progress)
    print_report(outcome, run)


@grouped
def merge(
    views: Annotated[list[Path], typer.Argument(metavar="VIEW...", help="Views stored by `scan --views`.")],
    output: Out,
    run: Run,
) -> None:
    """Merge turntable views of one page and restore it."""
    with report_faults(debug=run.debug), progress_on(sys.stderr) as progress:
        from station.run.destination import Destination
        from station.run.turntable import merge_files

        options = run_options(
            "merge", Kinds(review=True), Restoration(), rotate=run.rotate, allow_distorted=run.allow_distorted
        )
        outcome = merge_files(views, Destination(output, run.force), options, progress=progress)
    print_report(outcome, run)


@grouped
def restore(
    scan: Annotated[
        Path,
        typer.Argument(
            metavar="SCAN",
            help="Scan: range image, mesh, point cloud, CT segment, scan folder, folder of a depth image with its "
            "intrinsics, or folder of captured patterns; all formats: docs/reference/file-formats.md.",
        ),
    ],
    output: Out,
    reading: Reading,
    pictures: Pictures,
    chosen: Restoration,
    by_hand: ByHand,
    kinds: Kinds,
    run: Run,
) -> None:
    """Restore a page from a stored scan or mesh."""
    with report_faults(debug=run.debug), progress_on(sys.stderr) as progress:
        from station.run.destination import Destination
        from station.run.edits import check_saved, edits_of, save_edits
        from station.run.one_page import restore_file, stem_of

        stored = None if reading.no_edits else edits_of(scan, reading.edits)
        edits = by_hand.over(stored, reading.layout, output / f"{stem_of(scan)}-map.tif")
        if by_hand.save_edits is not None:
            check_saved(edits, by_hand.save_edits, force=run.force)
        read = {name: value for name, value in vars(reading).items() if name != "no_edits"} | {"edits": edits}
        outcome = restore_file(
            scan,
            Destination(output, run.force),
            run_options("restore", kinds, chosen, **read, rotate=run.rotate, allow_distorted=run.allow_distorted),
            texture=pictures.texture,
            photos=pictures.photo,
            shots=pictures.extra_scan,
            progress=progress,
        )
        if edits is not None and by_hand.save_edits is not None:
            save_edits(edits, scan, by_hand.save_edits, force=run.force)
    print_report(outcome, run)


@grouped
def photos(
    pictures: Annotated[
        list[Path], typer.Argument(metavar="IMG...", help="Photographs of one page from all sides, by one lens.")
    ],
    output: Out,
    chosen: Restoration,
    kinds: Kinds,
    run: Run,
    scale: Annotated[
        str,
        typer.Option(
            metavar="card|WxH|none",
            help="Scale: the card of `planish card`, the page's width x height in mm, or none.",
        ),
    ] = "card",
) -> None:
    """Restore a page from photographs alone, no scanner.

    Needs the extra `photos`.
    """
    with report_faults(debug=run.debug), progress_on(sys.stderr) as progress:
        from station.run.destination import Destination
        from station.run.photos import photographed_page

        options = run_options(
            "photos", kinds, chosen, scale=scale, rotate=run.rotate, allow_distorted=run.allow_distorted
        )
        outcome = photographed_page(pictures, Destination(output, run.force), options, progress=progress)
    print_report(outcome, run)


def print_report(outcome: Outcome, run: Run) -> None:
    """Print the report of a run, as JSON or as a summary."""
    from station.page_files.report import encode_report, left_out, summary

    with report_faults(debug=run.debug):
        if run.as_json:
            print_result(encode_report(outcome.report).rstrip())
        else:
            pages = [summary(page.report, page.files) for page in outcome.pages or (outcome,)]
            print_result("\n\n".join([*pages, *left_out(outcome.report.get("rejected", ()))]))
