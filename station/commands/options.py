"""The options of the commands, each declared once, and groups of them that several commands take.

A command takes a group as one parameter, a dataclass, and is wrapped with `grouped`.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from station.choices import FLAGS, Layout, Pieces, Turn
from station.errors import UsageError
from station.storage.session_folder import refuse_session, session_around

if TYPE_CHECKING:
    from station.run.options import RunOptions


def output_path(text: str) -> Path:
    """The path that an output option names.

    Raises BadParameter for an empty one, as of an unset shell variable, UsageError for one in a session.
    """
    if not text.strip():
        raise typer.BadParameter("the name is empty: give a path, or . for this folder")
    refuse_session(Path(text))
    return Path(text)


def new_folder_path(text: str) -> Path:
    """The path of a folder to make, as `output_path` has it; a session of that name is told by who would make it."""
    session = session_around(Path(text))
    return Path(text) if session == Path(os.path.realpath(text)) else output_path(text)


def require_suffix(output: Path, suffix: str) -> None:
    """Raise UsageError for the name of a file that tells another format than is written."""
    if output.suffix.lower() != suffix:
        raise UsageError(f"--output: {output} does not end in {suffix}, which is what is written", f"add {suffix}")


def unit_name(text: str) -> str:
    """The unit that an option names. Raises BadParameter for another text."""
    from restore import BadInput
    from restore.formats import check_unit

    try:
        check_unit(text)
    except BadInput as error:
        raise typer.BadParameter(f"{error}: {error.hint}") from error
    return text


Out = Annotated[
    Path,
    typer.Option(
        "--output", "-o", metavar="OUT", help="Folder for the results.", show_default=False, parser=output_path
    ),
]
Config = Annotated[
    Path,
    typer.Option(help="The station's configuration (TOML), or `simulated`, which comes along.", show_default=False),
]
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
Force = Annotated[bool, typer.Option("--force", help="Overwrite what an earlier run wrote.")]
Json = Annotated[bool, typer.Option("--json", help="Print as JSON.")]
TurnBy = Annotated[
    Turn, typer.Option("--turn", help="Degrees to turn the page clockwise; auto: as its words are read (Tesseract).")
]
Anyway = Annotated[bool, typer.Option("--anyway", help="Write a page whose surface is no page's, too.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show where in the program a fault happened.")]

MOST_S = 1e6  # of any time that is waited: eleven days


@dataclass(frozen=True)
class Kinds:
    """Optional output files and their settings."""

    tiff: Tiff = False
    map: Map = False
    mesh: Mesh = False
    strain: Strain = False
    frames: Frames = False
    review: Review = False
    ocr: Ocr = False
    coverage: Coverage = False
    language: Language = "eng"
    profile: Profile = None

    @property
    def wanted(self) -> frozenset[str]:
        """The kinds of `station.export.outputs.OUTPUTS` that were asked for."""
        return frozenset(name for name in FLAGS if getattr(self, name))


@dataclass(frozen=True)
class Run:
    """Options that all commands that write a page share."""

    force: Force = False
    turn: TurnBy = Turn.NONE
    anyway: Anyway = False
    as_json: Json = False
    debug: Debug = False


@dataclass(frozen=True)
class Restoration:
    """The settings of a restoration; None leaves the default of `restore.Settings`."""

    points: Annotated[int | None, typer.Option(help="Points kept for the flattening, 0 for all (1000).")] = None
    dpi: Annotated[float | None, typer.Option(help="Page pixels to an inch of paper (150).")] = None
    method: Annotated[
        str | None, typer.Option(help="isometric, sticks, springs, conformal or applicable (isometric).")
    ] = None
    shading: Annotated[str | None, typer.Option(help="Light and shadow: keep or remove (keep).")] = None
    white: Annotated[
        str | None,
        typer.Option(
            metavar="keep|paper|PROFILE",
            help="Colour of the light: keep it; make bare paper neutral; or convert to sRGB by the ICC profile of a "
            "chart in the same light, of `planish colour` (keep).",
        ),
    ] = None
    fill_hidden_mm: Annotated[
        float | None,
        typer.Option("--fill-hidden", metavar="MM", help="Invent hidden places up to this wide (0: leave them blank)."),
    ] = None

    @property
    def given(self) -> dict[str, Any]:
        """The settings that the operator named."""
        given = {item.name: value for item in fields(self) if (value := getattr(self, item.name)) is not None}
        if self.white_profile is not None:
            del given["white"]
        return given

    @property
    def white_profile(self) -> Path | None:
        """The file of the profile that `white` names, if it is one."""
        return None if self.white in (None, "keep", "paper") else Path(str(self.white))

    @classmethod
    def option(cls, setting: str) -> str:
        """The name of a setting on the command line."""
        return "--fill-hidden" if setting == "fill_hidden_mm" else f"--{setting.replace('_', '-')}"


def run_options(command: str, kinds: Kinds, chosen: Restoration, **others: Any) -> RunOptions:
    """The options of a command's run. others: of its fields. Raises BadInput for an unusable profile, UsageError."""
    from restore import Settings
    from station.config import build_model
    from station.run.options import RunOptions

    settings = build_model(Settings, chosen.given, name=chosen.option, hint=f"see planish {command} --help")
    return RunOptions(settings, kinds.wanted, kinds.language, **_colours(kinds, chosen), **others)


def _colours(kinds: Kinds, chosen: Restoration) -> dict[str, Any]:
    """The fields `colours` and `to_srgb` of run options."""
    from station.images.icc import read_profile

    path = chosen.white_profile
    if path is None:
        return {"colours": kinds.profile and read_profile(kinds.profile), "to_srgb": False}
    if kinds.profile is not None:
        raise UsageError("--white and --profile name a profile each", "give one: --white to convert, --profile to keep")
    if not path.is_file():
        raise UsageError(f"--white: there is no file {path}", "give keep, paper, or the ICC profile of a chart")
    return {"colours": read_profile(path), "to_srgb": True}


Unit = Annotated[
    str,
    typer.Option(
        metavar="UNIT",
        parser=unit_name,
        help="Unit of a mesh's coordinates: mm, cm, m, in, or the edge of a voxel, as 7.91um "
        "(auto: that of its format, else mm).",
    ),
]


@dataclass(frozen=True)
class Reading:
    """How a scan file is read, and which of its sheets become pages."""

    unit: Unit = "auto"
    pieces: Annotated[
        Pieces,
        typer.Option(
            help="Several sheets in one scan: each a page, left to right; the largest; together in one picture "
            "(auto: each rectangular sheet of a mesh, fragments together, of a shot the largest)."
        ),
    ] = Pieces.AUTO
    layout: Annotated[
        Layout,
        typer.Option(help="An opened book: one page; two leaves where a spine is certain (auto); two; never two."),
    ] = Layout.SINGLE


@dataclass(frozen=True)
class Pictures:
    """Image files from which a restoration takes colour."""

    texture: Annotated[Path | None, typer.Option(help="The colour image, where the scan has none.")] = None
    photo: Annotated[
        list[Path], typer.Option(metavar="IMG", help="A photograph of the page to paint from; may be repeated.")
    ] = field(default_factory=list)
    shot: Annotated[list[Path], typer.Option(help="A further shot of the page, for finer colour; once for each.")] = (
        field(default_factory=list)
    )


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """The command with every field of its dataclass parameters as a parameter of its own, as typer wants them."""
    hints = get_type_hints(command, include_extras=True)
    groups = {name: hint for name, hint in hints.items() if is_dataclass(hint) and isinstance(hint, type)}
    plain, grouped_ = [], []
    for name, parameter in inspect.signature(command).parameters.items():
        if name in groups:
            grouped_ += _parameters(groups[name])
        else:
            plain.append(parameter.replace(annotation=hints[name], kind=parameter.KEYWORD_ONLY))

    @wraps(command)
    def flat(**values: Any) -> None:
        made = {
            name: group(**{item.name: values.pop(item.name) for item in fields(group)})
            for name, group in groups.items()
        }
        command(**made, **values)

    parameters = [*plain, *grouped_]
    flat.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    flat.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return flat


def _parameters(group: type) -> list[inspect.Parameter]:
    """A parameter for every field of a dataclass, with its declaration as an option and its default."""
    hints = get_type_hints(group, include_extras=True)
    default = group()
    return [
        inspect.Parameter(
            item.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=getattr(default, item.name),
            annotation=hints[item.name],
        )
        for item in fields(group)
    ]
