"""The command `planish`: options in, exit code out. The work is in `session`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from station.calibrate import board, calibrate
from station.devices import devices
from station.doctor import doctor
from station.progress import progress_on
from station.telling import faults_told, say
from station.trace import trace

if TYPE_CHECKING:
    from station.session import Outcome

# `session` and what it needs take a second to import: inside the commands, so that `--help` answers at once.
app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)

Config = Annotated[
    Path,
    typer.Option(help="The station's configuration (TOML), or `simulated`, which comes along.", show_default=False),
]
Out = Annotated[Path, typer.Option("--output", "-o", metavar="OUT", help="Folder for the results.", show_default=False)]
Coverage = Annotated[bool, typer.Option("--coverage", help="Write where the page was seen, hidden or invented.")]
Tiff = Annotated[bool, typer.Option("--tiff", help="Write the page as TIFF, too.")]
Map = Annotated[bool, typer.Option("--map", help="Write the map: the source pixel of every page pixel.")]
Mesh = Annotated[bool, typer.Option("--mesh", help="Write the mesh as OBJ, flat and as it was measured.")]
Strain = Annotated[bool, typer.Option("--strain", help="Draw where the flattening stretched the page.")]
Frames = Annotated[bool, typer.Option("--frames", help="Draw eight frames of the flattening.")]
Review = Annotated[bool, typer.Option("--review", help="Draw colour image, 3D view and page side by side.")]
Ocr = Annotated[bool, typer.Option("--ocr", help="Read the words: text, ALTO and searchable PDF/A (needs Tesseract).")]
Language = Annotated[str, typer.Option(help="Language of the words, as Tesseract calls it; several joined by +.")]
Profile = Annotated[Path | None, typer.Option(help="ICC profile of the colour image, of `planish colour` (sRGB).")]
Force = Annotated[bool, typer.Option("--force", help="Overwrite the results of an earlier run.")]
Json = Annotated[bool, typer.Option("--json", help="Print the report as JSON.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show where in the program a fault happened.")]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with the given arguments, the process's own when None. Returns the exit code."""
    try:
        app(None if arguments is None else list(arguments), prog_name="planish")
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def _print_version(wanted: bool) -> None:
    if not wanted:
        return
    try:
        text = f"planish {version('planish')}"
    except PackageNotFoundError:
        text = "planish, from the sources, not installed"
    with faults_told():
        say(text)
    raise typer.Exit


@app.callback()
def _planish(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Turn a 3D scan of a warped page into the flat page it once was."""


@app.command("scan")
def _scan(
    config: Config,
    output: Out,
    average: Annotated[int | None, typer.Option(min=1, max=64, help="Shots to average (1).")] = None,
    turns: Annotated[int | None, typer.Option(min=2, max=72, help="Views to take on the rotary stage.")] = None,
    shots: Annotated[
        int | None,
        typer.Option("--super", min=4, max=64, help="Shots, the page moved by half a pixel between, for finer colour."),
    ] = None,
    tiff: Tiff = False,
    map_: Map = False,
    mesh: Mesh = False,
    strain: Strain = False,
    frames: Frames = False,
    ocr: Ocr = False,
    language: Language = "eng",
    profile: Profile = None,
    force: Force = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Capture a page, store the scan, restore the page."""
    with faults_told(debug=debug), progress_on(sys.stderr) as progress:
        from station.config import load_config
        from station.session import Destination, scan_page
        from station.turntable import scan_views

        kinds = _kinds(tiff=tiff, map=map_, mesh=mesh, strain=strain, frames=frames, review=True, ocr=ocr)
        station = load_config(config)
        capture = replace(station.capture, **_given(average=average))
        station = station.model_copy(update={"capture": capture})
        destination = Destination(output, kinds, force, language, _colours(profile))
        if turns is None:
            outcome = scan_page(station, destination, shots=shots or 1, progress=progress)
        else:
            outcome = scan_views(station, destination, turns=turns, progress=progress)
    _tell(outcome, as_json=as_json, debug=debug)


@app.command("demo")
def _demo(output: Out, force: Force = False, as_json: Json = False, debug: Debug = False) -> None:
    """Scan a simulated page and restore it: nothing else is needed."""
    with faults_told(debug=debug), progress_on(sys.stderr) as progress:
        from station.config import DEMONSTRATION, load_config
        from station.session import Destination, scan_page

        destination = Destination(output, _kinds(review=True), force)
        outcome = scan_page(load_config(DEMONSTRATION), destination, progress=progress)
    _tell(outcome, as_json=as_json, debug=debug)


@app.command("merge")
def _merge(
    views: Annotated[list[Path], typer.Argument(metavar="VIEW...", help="Views that `scan --turns` stored.")],
    output: Out,
    force: Force = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Merge the views of a rotary stage and restore the page."""
    with faults_told(debug=debug), progress_on(sys.stderr) as progress:
        from restore import Settings
        from station.session import Destination
        from station.turntable import merge_files

        destination = Destination(output, _kinds(review=True), force)
        outcome = merge_files(views, destination, settings=Settings(), progress=progress)
    _tell(outcome, as_json=as_json, debug=debug)


@app.command("axis")
def _axis(
    config: Config,
    output: Out,
    turns: Annotated[int, typer.Option(min=3, max=72, help="Views of the board.")] = 4,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Find the axis of the rotary stage with a flat board of markers on it."""
    with faults_told(debug=debug), progress_on(sys.stderr) as progress:
        from station.config import load_config
        from station.session import Destination
        from station.turntable import axis_table, find_axis

        fit, path = find_axis(load_config(config), Destination(output, force=force), turns=turns, progress=progress)
        say(f"{path}\n{axis_table(fit).rstrip()}")


@app.command("restore")
def _restore(
    scan: Annotated[
        Path,
        typer.Argument(metavar="SCAN", help="A scan: .abs[.gz], .obj, .ply, .stl, .glb, .wrl, .vvd or a scan folder."),
    ],
    output: Out,
    texture: Annotated[Path | None, typer.Option(help="The colour image, where the scan has none.")] = None,
    photo: Annotated[
        list[Path] | None, typer.Option(metavar="IMG", help="A photograph of the page to paint from; may be repeated.")
    ] = None,
    points: Annotated[int | None, typer.Option(help="Points kept for the flattening, 0 for all (1000).")] = None,
    shot: Annotated[
        list[Path] | None, typer.Option(help="A further shot of the page, for finer colour; once for each.")
    ] = None,
    dpi: Annotated[float | None, typer.Option(help="Page pixels to an inch of paper (150).")] = None,
    method: Annotated[str | None, typer.Option(help="How to flatten: sticks, springs or conformal (sticks).")] = None,
    shading: Annotated[str | None, typer.Option(help="Light and shadow: keep or remove (keep).")] = None,
    fill_hidden: Annotated[
        float | None, typer.Option(metavar="MM", help="Invent hidden places up to this wide (0: leave them blank).")
    ] = None,
    coverage: Coverage = False,
    tiff: Tiff = False,
    map_: Map = False,
    mesh: Mesh = False,
    strain: Strain = False,
    frames: Frames = False,
    review: Review = False,
    ocr: Ocr = False,
    language: Language = "eng",
    profile: Profile = None,
    force: Force = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Restore the page from a stored scan."""
    with faults_told(debug=debug), progress_on(sys.stderr) as progress:
        from restore import Settings
        from station.config import checked
        from station.session import Destination, restore_file

        kinds = _kinds(
            tiff=tiff, map=map_, mesh=mesh, strain=strain, frames=frames, review=review, ocr=ocr, coverage=coverage
        )
        chosen = _given(points=points, dpi=dpi, method=method, shading=shading, fill_hidden_mm=fill_hidden)
        outcome = restore_file(
            scan,
            Destination(output, kinds, force, language, _colours(profile)),
            settings=checked(Settings, chosen, name="--{}".format, hint="see planish restore --help"),
            texture=texture,
            photos=photo or (),
            shots=shot or [],
            progress=progress,
        )
    _tell(outcome, as_json=as_json, debug=debug)


@app.command("ocr")
def _ocr(
    page: Annotated[Path, typer.Argument(metavar="PAGE", help="A restored page, or the folder of results it is in.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="OUT", help="Folder for what is read (the page's own).")
    ] = None,
    language: Language = "eng",
    truth: Annotated[
        Path | None, typer.Option(help="What is printed on the page, as text: tells how well it was read.")
    ] = None,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Read the words of a restored page: text, ALTO and searchable PDF/A (needs Tesseract)."""
    with faults_told(debug=debug), progress_on(sys.stderr) as progress:
        from station.ocr import read_pages, told

        for read in read_pages(page, output, language=language, truth=truth, force=force, progress=progress):
            say(told(read))


@app.command("colour")
def _colour(
    target: Annotated[
        Path, typer.Argument(metavar="TARGET", help="A picture, a restored page or a scan of a ColorChecker Classic.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="PROFILE", help="The ICC profile to write.")],
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Measure a colour chart: an ICC profile of the camera, and the levels of FADGI and ISO 19264 that it meets."""
    with faults_told(debug=debug):
        from station.colour.run import profile_colours, told

        say(told(profile_colours(target, output, force=force)))


def _colours(profile: Path | None) -> bytes | None:
    from station.export.icc import read_profile

    return None if profile is None else read_profile(profile)


for command in (devices, doctor, trace, board, calibrate):
    app.command()(command)


def _kinds(**wanted: bool) -> frozenset[str]:
    return frozenset(kind for kind, on in wanted.items() if on)


def _given(**options: Any) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


def _tell(outcome: Outcome, *, as_json: bool, debug: bool) -> None:
    from station.export.report import encode_report, summary

    with faults_told(debug=debug):
        say(encode_report(outcome.report).rstrip() if as_json else summary(outcome.report, outcome.files))
