"""The options of the commands, each declared once.

Several commands take groups of them. A command takes a group as one parameter, a dataclass, and is wrapped with
`grouped`.
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

from station.choices import FLAGS, Layout, Method, Rotation, Shading, Sheets
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
    """Return the path of a folder to make, as `output_path` has it.

    The maker of a session reports one of that name.
    """
    session = session_around(Path(text))
    return Path(text) if session == Path(os.path.realpath(text)) else output_path(text)


def require_suffix(output: Path, suffix: str) -> None:
    """Raise UsageError for a file name of another format.

    Another one than is written.
    """
    if output.suffix.lower() != suffix:
        raise UsageError(f"--output: {output} does not end in {suffix}, which is what is written", f"add {suffix}")


def unit_name(text: str) -> str:
    """The unit that an option names. Raises BadParameter for another text."""
    return _checked(text, "check_unit")


def grid_size(text: str) -> str:
    """The size of a grid that an option names. Raises BadParameter for another text."""
    return _checked(text, "parse_grid")


def depth_kind(text: str) -> str:
    """The kind of depth that an option names. Raises BadParameter for another text."""
    return _checked(text, "check_depth")


def _checked(text: str, by: str) -> str:
    from restore import BadInput, formats

    try:
        getattr(formats, by)(text)
    except BadInput as error:
        raise typer.BadParameter(f"{error}: {error.hint}") from error
    return text


def output_names(text: str) -> list[str]:
    """Return the names in a list separated by commas.

    Raises UsageError for one that is not an output.
    """
    names = [name for part in text.split(",") if (name := part.strip())]
    if unknown := [name for name in names if name not in FLAGS]:
        raise UsageError(f"--outputs: {unknown[0]!r} is not an output", f"give names of {', '.join(FLAGS)}")
    return names


Out = Annotated[
    Path,
    typer.Option(
        "--output", "-o", metavar="OUT", help="Folder for the results.", show_default=False, parser=output_path
    ),
]
Config = Annotated[
    Path,
    typer.Option(help="Configuration of the station: a TOML file, or `simulated`.", show_default=False),
]
Outputs = Annotated[str, typer.Option(metavar="NAME,…", help=f"Further files: {', '.join(FLAGS)}.", show_default=False)]
Coverage = Annotated[
    bool, typer.Option("--coverage", help="Write the coverage map: measured, interpolated, occluded, …")
]
Tiff = Annotated[bool, typer.Option("--tiff", help="Write the page as TIFF also.")]
Map = Annotated[bool, typer.Option("--map", help="Write the map from page pixels to source pixels.")]
Mesh = Annotated[bool, typer.Option("--mesh", help="Write the mesh as OBJ, flattened and as measured.")]
Strain = Annotated[bool, typer.Option("--strain", help="Draw the strain of the flattening.")]
Frames = Annotated[bool, typer.Option("--frames", help="Draw eight frames of the flattening.")]
Review = Annotated[bool, typer.Option("--review", help="Draw source image, 3D view and page side by side.")]
Ocr = Annotated[bool, typer.Option("--ocr", help="Recognise text: TXT, ALTO, PDF/A (needs Tesseract).")]
Language = Annotated[
    str, typer.Option("--language", "-l", help="Language of the text as a Tesseract code; join several with +.")
]
IccProfile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", help="ICC profile of the source image, written by `planish colour`.", show_default="sRGB"
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Overwrite the files of an earlier run.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
RotateBy = Annotated[
    Rotation,
    typer.Option("--rotate", help="Rotate the page clockwise by degrees; auto: by OCR."),
]
AllowDistorted = Annotated[
    bool, typer.Option("--allow-distorted", help="Write a page also if its surface is too distorted for paper.")
]
Debug = Annotated[bool, typer.Option("--debug", help="Print the traceback of an error.")]

MAX_S = 1e6  # of any time that is waited: eleven days


@dataclass(frozen=True)
class Kinds:
    """Optional output files and their settings."""

    outputs: Outputs = ""
    tiff: Tiff = False
    map: Map = False
    mesh: Mesh = False
    strain: Strain = False
    frames: Frames = False
    review: Review = False
    ocr: Ocr = False
    coverage: Coverage = False
    language: Language = "eng"
    icc_profile: IccProfile = None

    @property
    def wanted(self) -> frozenset[str]:
        """Return the kinds of outputs that were requested.

        Of `station.page_files.outputs.OUTPUTS`, by --outputs or by a flag of each.
        """
        return frozenset(output_names(self.outputs)) | {name for name in FLAGS if getattr(self, name)}


@dataclass(frozen=True)
class Run:
    """Options of all commands that write a page."""

    force: Force = False
    rotate: RotateBy = Rotation.NONE
    allow_distorted: AllowDistorted = False
    as_json: Json = False
    debug: Debug = False


@dataclass(frozen=True)
class Restoration:
    """The settings of a restoration; None leaves the default of `restore.Settings`."""

    points: Annotated[
        int | None, typer.Option(help="Points kept for flattening; 0 keeps all.", show_default="1000")
    ] = None
    dpi: Annotated[float | None, typer.Option(help="Pixels per inch of the page.", show_default="150")] = None
    method: Annotated[Method | None, typer.Option(help="Flattening method.", show_default="isometric")] = None
    shading: Annotated[Shading | None, typer.Option(help="Keep or remove light and shadow.", show_default="keep")] = (
        None
    )
    white_balance: Annotated[
        str | None,
        typer.Option(
            metavar="keep|paper|FILE",
            help="Keep the colour of the light, make bare paper neutral, or convert to sRGB by an ICC profile of "
            "`planish colour`.",
            show_default="keep",
        ),
    ] = None
    inpaint_mm: Annotated[
        float | None,
        typer.Option("--inpaint", metavar="MM", help="Inpaint occluded places up to this width.", show_default="0"),
    ] = None

    uncertainty: Annotated[
        bool | None,
        typer.Option("--uncertainty/--no-uncertainty", help="Estimate how far places may be off, in mm."),
    ] = None

    @property
    def given(self) -> dict[str, Any]:
        """The settings that the operator named."""
        given = {item.name: value for item in fields(self) if (value := getattr(self, item.name)) is not None}
        if self.white_profile is not None:
            del given["white_balance"]
        return given

    @property
    def white_profile(self) -> Path | None:
        """The file of the profile that `white` names, if it is one."""
        return None if self.white_balance in (None, "keep", "paper") else Path(str(self.white_balance))

    @classmethod
    def option(cls, setting: str) -> str:
        """The name of a setting on the command line."""
        return "--inpaint" if setting == "inpaint_mm" else f"--{setting.replace('_', '-')}"


def run_options(command: str, kinds: Kinds, chosen: Restoration, **others: Any) -> RunOptions:
    """Return the options of a command's run.

    others: of its fields.
    Raises BadInput for an unusable profile, UsageError.
    """
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
        return {"colours": kinds.icc_profile and read_profile(kinds.icc_profile), "to_srgb": False}
    if kinds.icc_profile is not None:
        raise UsageError(
            "--white-balance and --icc-profile both name a profile",
            "give one: --white-balance to convert, --icc-profile to keep",
        )
    if not path.is_file():
        raise UsageError(
            f"--white-balance: the file {path} does not exist", "give keep, paper, or the ICC profile of a chart"
        )
    return {"colours": read_profile(path), "to_srgb": True}


Unit = Annotated[
    str,
    typer.Option(
        metavar="UNIT",
        parser=unit_name,
        help="Unit of mesh coordinates: mm, cm, m, in, or a voxel's edge like 7.91um; auto: of the format, else mm.",
    ),
]


@dataclass(frozen=True)
class FileReading:
    """How a scan file is read, where it leaves that open."""

    unit: Unit = "auto"
    grid: Annotated[
        str,
        typer.Option(
            metavar="COLSxROWS",
            parser=grid_size,
            help="Size of an organised cloud, as 2064x1544; auto: as its file says, or its points show.",
        ),
    ] = "auto"
    depth: Annotated[
        str,
        typer.Option(
            metavar="axis|ray",
            parser=depth_kind,
            help="Depths of an image: along the camera's axis, or of the ray; auto: as its file says.",
        ),
    ] = "auto"


@dataclass(frozen=True)
class Reading(FileReading):
    """How a scan file is read, and which of its sheets become pages."""

    scale: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Size of a mesh's page in mm, in either order; it replaces the unit."),
    ] = None
    mirror: Annotated[bool, typer.Option("--mirror", help="Mirror the page: its file is a mirror image.")] = False
    sheets: Annotated[
        Sheets,
        typer.Option(
            help="Several sheets in one scan: a page each, the largest only, or all in one image; auto: by their shape."
        ),
    ] = Sheets.AUTO
    layout: Annotated[
        Layout,
        typer.Option(help="An opened book: one page; two leaves where a spine is certain (auto); two; never two."),
    ] = Layout.SINGLE
    edits: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Corrections by hand; <stem>.edits.json next to the scan by default."),
    ] = None
    no_edits: Annotated[bool, typer.Option("--no-edits", help="Ignore corrections by hand.")] = False


@dataclass(frozen=True)
class Pictures:
    """Image files from which a restoration takes colour."""

    texture: Annotated[Path | None, typer.Option(metavar="IMG", help="Source image, if the scan has none.")] = None
    photo: Annotated[
        list[Path], typer.Option(metavar="IMG", help="Photograph of the page as texture; repeat for more.")
    ] = field(default_factory=list)
    extra_scan: Annotated[
        list[Path],
        typer.Option(metavar="SCAN", help="Further scan of the page, for super-resolution; repeat for more."),
    ] = field(default_factory=list)


def reading_options(reading: FileReading) -> dict[str, str]:
    """Return how a file is read, for run options and `load_scan`."""
    return {item.name: getattr(reading, item.name) for item in fields(FileReading)}


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with the fields of its dataclasses as parameters.

    Each field is a separate parameter, as typer needs them.
    """
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
    """Return a parameter for every field of a dataclass.

    With its declaration as an option and its default.
    """
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
