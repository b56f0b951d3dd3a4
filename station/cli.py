"""The command `planish`: options in, exit code out. The work is in `one_page`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.archive.command import export
from station.ask import ask
from station.batch.command import batch
from station.calibrate import board, calibrate
from station.console.command import serve
from station.devices import devices
from station.doctor import doctor
from station.errors import USAGE, UsageError, explain
from station.options import (
    Config,
    Debug,
    Force,
    Kinds,
    Language,
    Out,
    Pictures,
    Reading,
    Restoration,
    Run,
    colours_of,
    grouped,
    output_path,
)
from station.park import park
from station.patterns import patterns
from station.photos_card import card
from station.progress import progress_on
from station.session_commands import app as sessions
from station.session_commands import reindex, repair, replay, verify
from station.shoot import shoot
from station.terminal import (
    READER_GONE,
    CommandLineError,
    occupy_standard_streams,
    print_fault,
    print_result,
    report_faults,
    usage_fault,
)
from station.trace import trace
from station.version import software_version
from station.warm_up import warm_up
from station.watch.command import watch

if TYPE_CHECKING:
    from station.destination import Destination, Outcome

# `one_page` and what it needs take a second to import: inside the commands, so that `--help` answers at once.
app = typer.Typer(
    add_completion=False, invoke_without_command=True, pretty_exceptions_enable=False, rich_markup_mode=None
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with the given arguments, the process's own when None. Returns the exit code."""
    occupy_standard_streams()
    try:
        code = app(None if arguments is None else list(arguments), prog_name="planish", standalone_mode=False)
    except SystemExit as end:  # typer ends so when nobody reads its help
        return READER_GONE if isinstance(end.__context__, BrokenPipeError) else int(end.code or 0)
    except UsageError as error:  # of an option, before its command begins
        print_fault(explain(error))
        return USAGE
    except Exception as error:
        if not isinstance(error, CommandLineError):
            raise
        print_fault(usage_fault(error))
        return USAGE
    return int(code or 0)


@app.callback()
def _planish(
    context: typer.Context, version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False
) -> None:
    """Turn a 3D scan of a warped page into the flat page it once was."""
    if version or context.invoked_subcommand is None:
        with report_faults():
            print_result(software_version() if version else context.get_help())
        raise typer.Exit(0 if version else USAGE)


@app.command("scan")
@grouped
def _scan(
    config: Config,
    output: Out,
    kinds: Kinds,
    run: Run,
    average: Annotated[int | None, typer.Option(min=1, max=64, help="Shots to average (1).")] = None,
    turns: Annotated[int | None, typer.Option(min=2, max=72, help="Views to take on the rotary stage.")] = None,
    shots: Annotated[
        int | None,
        typer.Option("--super", min=4, max=64, help="Shots, the page moved by half a pixel between, for finer colour."),
    ] = None,
) -> None:
    """Capture a page, store the scan, restore the page."""
    with report_faults(debug=run.debug), progress_on(sys.stderr) as progress:
        from station.config import load_config
        from station.one_page import scan_page
        from station.turntable import scan_views

        station = load_config(config)
        if average is not None:
            station = station.model_copy(update={"capture": replace(station.capture, average=average)})
        destination = _destination(output, replace(kinds, review=True), run)
        if turns is None:
            outcome = scan_page(station, destination, shots=shots or 1, progress=progress)
        else:
            outcome = scan_views(station, destination, turns=turns, progress=progress)
    _print_report(outcome, run)


@app.command("demo")
@grouped
def _demo(output: Out, run: Run) -> None:
    """Scan a simulated page and restore it: nothing else is needed."""
    with report_faults(debug=run.debug), progress_on(sys.stderr) as progress:
        from station.config import DEMONSTRATION, load_config
        from station.one_page import scan_page

        destination = _destination(output, Kinds(review=True), run)
        outcome = scan_page(load_config(DEMONSTRATION), destination, progress=progress)
    _print_report(outcome, run)


@app.command("merge")
@grouped
def _merge(
    views: Annotated[list[Path], typer.Argument(metavar="VIEW...", help="Views that `scan --turns` stored.")],
    output: Out,
    run: Run,
) -> None:
    """Merge the views of a rotary stage and restore the page."""
    with report_faults(debug=run.debug), progress_on(sys.stderr) as progress:
        from restore import Settings
        from station.turntable import merge_files

        destination = _destination(output, Kinds(review=True), run)
        outcome = merge_files(views, destination, settings=Settings(), progress=progress)
    _print_report(outcome, run)


@app.command("axis")
def _axis(
    config: Config,
    output: Out,
    turns: Annotated[int, typer.Option(min=3, max=72, help="Views of the board.")] = 4,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Find the axis of the rotary stage with a flat board of markers on it."""
    with report_faults(debug=debug), progress_on(sys.stderr) as progress:
        from station.config import load_config
        from station.destination import Destination
        from station.turntable import axis_table, find_axis

        fit, path = find_axis(load_config(config), Destination(output, force=force), turns=turns, progress=progress)
        print_result(f"{path}\n{axis_table(fit).rstrip()}")


@app.command("restore")
@grouped
def _restore(
    scan: Annotated[
        Path,
        typer.Argument(
            metavar="SCAN",
            help="A scan: .abs[.gz], .obj, .ply, .stl, .glb, .gltf, .wrl, .vvd, a scan folder or one of captured "
            "patterns; a segment: .vcps or tifxyz.",
        ),
    ],
    output: Out,
    reading: Reading,
    pictures: Pictures,
    chosen: Restoration,
    kinds: Kinds,
    run: Run,
) -> None:
    """Restore the page from a stored scan."""
    with report_faults(debug=run.debug), progress_on(sys.stderr) as progress:
        from restore import Settings
        from station.config import build_model
        from station.one_page import restore_file

        outcome = restore_file(
            scan,
            replace(_destination(output, kinds, run), pieces=reading.pieces, **colours_of(kinds, chosen)),
            settings=build_model(Settings, chosen.given, name=chosen.option, hint="see planish restore --help"),
            texture=pictures.texture,
            photos=pictures.photo,
            shots=pictures.shot,
            unit=reading.unit,
            progress=progress,
        )
    _print_report(outcome, run)


@app.command("photos")
@grouped
def _photos(
    pictures: Annotated[
        list[Path], typer.Argument(metavar="IMG...", help="Photographs of one page from all round, by one lens.")
    ],
    output: Out,
    chosen: Restoration,
    kinds: Kinds,
    run: Run,
    scale: Annotated[
        str,
        typer.Option(
            metavar="card|WxH|none",
            help="Scale: the card of `planish card` beside the page; the page's width x height in mm; or none.",
        ),
    ] = "card",
) -> None:
    """Restore a page from photographs of it alone: no scanner (extra `photos`)."""
    with report_faults(debug=run.debug), progress_on(sys.stderr) as progress:
        from restore import Settings
        from station.config import build_model
        from station.photos import Scale, photographed_page

        outcome = photographed_page(
            pictures,
            replace(_destination(output, kinds, run), **colours_of(kinds, chosen)),
            settings=build_model(Settings, chosen.given, name=chosen.option, hint="see planish photos --help"),
            scale=Scale.parse(scale),
            progress=progress,
        )
    _print_report(outcome, run)


@app.command("ocr")
def _ocr(
    page: Annotated[Path, typer.Argument(metavar="PAGE", help="A restored page, or the folder of results it is in.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="OUT", help="Folder for what is read (the page's own).", parser=output_path
        ),
    ] = None,
    language: Language = "eng",
    truth: Annotated[
        Path | None, typer.Option(help="What is printed on the page, as text: tells how well it was read.")
    ] = None,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Read the words of a restored page: text, ALTO and searchable PDF/A (needs Tesseract)."""
    with report_faults(debug=debug), progress_on(sys.stderr) as progress:
        from station.ocr import read_pages, summary_line

        for read in read_pages(page, output, language=language, truth=truth, force=force, progress=progress):
            print_result(summary_line(read))


@app.command("colour")
def _colour(
    target: Annotated[
        Path, typer.Argument(metavar="TARGET", help="A picture, a restored page or a scan of a ColorChecker Classic.")
    ],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="PROFILE", help="The ICC profile to write.", parser=output_path),
    ],
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Measure a colour chart: an ICC profile of the camera, and the levels of FADGI and ISO 19264 that it meets."""
    with report_faults(debug=debug):
        from station.colour.run import profile_colours, summary_line

        print_result(summary_line(profile_colours(target, output, force=force)))


for command in (
    *(devices, doctor, ask, park, trace, board, calibrate, card, patterns, warm_up, watch),
    *(shoot, serve, verify, repair, replay, reindex),
    *(batch, export),
):
    app.command()(command)
app.add_typer(sessions, name="session")


def _destination(folder: Path, kinds: Kinds, run: Run) -> Destination:
    """The destination of a run from its options. Raises BadInput for an unusable profile."""
    from station.destination import Destination
    from station.export.icc import read_profile

    colours = None if kinds.profile is None else read_profile(kinds.profile)
    return Destination(folder, kinds.wanted, run.force, kinds.language, colours, turn=run.turn, anyway=run.anyway)


def _print_report(outcome: Outcome, run: Run) -> None:
    """Print the report of a run, as JSON or as a summary."""
    from station.export.report import encode_report, left_out, summary

    with report_faults(debug=run.debug):
        if run.as_json:
            print_result(encode_report(outcome.report).rstrip())
        else:
            pages = [summary(page.report, page.files) for page in outcome.pages or (outcome,)]
            print_result("\n\n".join([*pages, *left_out(outcome.report.get("left_out", ()))]))
