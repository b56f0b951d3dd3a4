"""The options of `planish restore` that correct a page by hand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.choices import Layout
from station.errors import UsageError

if TYPE_CHECKING:
    from restore import PageEdits

PARTS_OF = {"whole": ("page",), "left": ("left",), "right": ("right",), "split": ("left", "right")}
POINTS = ("spine", "outline", "remove", "keep")
ALL = ("page", "left", "right")  # where the layout is not known before the scan is read


@dataclass(frozen=True)
class ByHand:
    """Corrections by hand as single options; they win over those of a file."""

    spine: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y:X,Y…",
            help="Split here, head to tail: pixels of the source image, or mm of the last --map result: X,Y:X,Ymm.",
        ),
    ] = None
    outline: Annotated[
        str | None, typer.Option(metavar="X,Y:X,Y:X,Y…", help="Edge of the paper, in pixels of the source image.")
    ] = None
    remove: Annotated[
        list[str], typer.Option(metavar="X,Y:X,Y:X,Y…", help="Area to remove, as a finger; repeat for more.")
    ] = field(default_factory=list)
    keep: Annotated[
        list[str], typer.Option(metavar="X,Y:X,Y:X,Y…", help="Area of paper that was not found; repeat for more.")
    ] = field(default_factory=list)
    angle: Annotated[float | None, typer.Option(metavar="DEG", help="Fine rotation, clockwise, at most 45.")] = None
    crop: Annotated[
        str | None, typer.Option(metavar="paper|margin:MM|box:L,T,R,B", help="What of the page is shown.")
    ] = None
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Size of the leaf in mm, to check it; nothing is scaled.")
    ] = None
    overlap: Annotated[float | None, typer.Option(metavar="MM", help="Facing page that each leaf keeps, 0 to 10.")] = (
        None
    )
    save_edits: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the corrections, as <stem>.edits.json.")
    ] = None

    def fields(self) -> Iterator[tuple[str, str, str]]:
        """Yield option, field of the corrections and value of each correction."""
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name != "save_edits" and value is not None:
                name = "rotate" if item.name == "angle" else item.name
                yield from (
                    (f"--{item.name}", name, str(one)) for one in (value if isinstance(value, list) else [value])
                )

    def over(self, edits: PageEdits | None, layout: Layout, last_map: Path) -> PageEdits | None:
        """Return corrections of a file with the options in place of their fields.

        layout: of the command. last_map: file of the map of the last result, for points in mm.
        Raises UsageError that names the option, BadInput for mm without a map or off the paper.
        """
        from restore import BadInput, PageEdits
        from station.session.corrections.fields import changed

        given = list(self.fields())
        if not given:
            return edits
        by_option = layout.value if layout != Layout.SINGLE else "split" if self.spine is not None else ""
        edits = edits or PageEdits(layout="whole")
        edits = edits.model_copy(update={"layout": by_option} if by_option else {})
        parts = PARTS_OF.get(edits.layout, tuple(edits.parts) or ALL)
        for option, name, value in given:
            if not value.strip():
                raise UsageError(f"{option} is empty", f"give it a value, or leave {option} out")
            value = _in_pixels(option, name, value, last_map)
            try:
                edits = changed(edits, [f"{name}={value}"], parts)
            except BadInput as error:
                reason = str(error).removeprefix(f"{name}: ").removeprefix("the corrections: ")
                raise UsageError(f"{option}: {reason}", error.hint) from error
        return edits.made_by(tool="cli")


def _in_pixels(option: str, name: str, value: str, last_map: Path) -> str:
    """Return points in mm of the last result as pixels; all else as it is.

    Raises UsageError for a text that cannot be read, BadInput without a map, or off the paper.
    """
    if name not in POINTS or not value.rstrip().endswith("mm"):
        return value
    from restore import BadInput
    from station.run.result_map import pixels_of
    from station.session.corrections.fields import parse_points

    try:
        places = parse_points(name, value.rstrip().removesuffix("mm"))
    except BadInput as error:
        raise UsageError(f"{option}: {value!r} cannot be read", error.hint) from error
    points = pixels_of(places, last_map)
    return ":".join(f"{x:g},{y:g}" for x, y in points)
