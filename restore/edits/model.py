"""The format `planish-edits`: what an operator corrects on a page.

It is anchored in the scan's own image.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from restore.errors import BadInput
from restore.settings import Settings

FORMAT, VERSION = "planish-edits", 1
MAX_BYTES = 48 * 1024  # of a file: the web interface takes bodies of 64 KiB
MAX_POINTS = 2000  # in all: no outline drawn by hand has more
HINT = "see docs/how-to/opened-books.md for the fields"

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
Point = Annotated[tuple[Coordinate, ...], Field(min_length=2, max_length=3)]
Frame = Literal["picture", "space"]
COORDINATES: Mapping[Frame, int] = {"picture": 2, "space": 3}
Kind = Literal["leaf", "spread", "plate", "cover", "foldout", "insert", "target", "blank"]
WHOLE: frozenset[Kind] = frozenset({"plate", "cover", "foldout", "insert", "target"})  # kinds that are never split
Polygon = Annotated[tuple[Point, ...], Field(min_length=3, max_length=200)]
Points = tuple[Point, ...]
Move = Callable[[Points], Points]  # from pixels of one image to those of another
Part = Literal["page", "left", "right"]
PARTS: tuple[Part, ...] = ("page", "left", "right")
OF_THE_FILE = ("format", "version", "frame", "by", "scan")  # fields that correct nothing
STRICT = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Mask(BaseModel):
    """Area of the image.

    what: remove a finger, weight or clip; keep paper that was not found.
    """

    model_config = STRICT
    what: Literal["remove", "keep"]
    polygon: Polygon


class Crop(BaseModel):
    """What of a page is shown: to the paper's edge, to a margin beyond it, or in a box."""

    model_config = STRICT
    mode: Literal["paper", "margin", "box"] = "paper"
    margin_mm: Annotated[float, Field(ge=0, le=100)] = 0.0
    box: tuple[Coordinate, Coordinate, Coordinate, Coordinate] | None = None

    @model_validator(mode="after")
    def _has_a_box(self) -> Self:
        if self.mode == "box" and (self.box is None or self.box[0] >= self.box[2] or self.box[1] >= self.box[3]):
            raise ValueError("a box is [left, top, right, bottom] in mm, with left < right and top < bottom")
        return self


class PartEdits(BaseModel):
    """The corrections of one part of a scan.

    outline     the paper's edge; None as found. masks: areas to remove or keep.
    turn        quarters clockwise. rotate_deg: clockwise, on top of them.
    settings    a subset of `Settings` for this part. label: of loose scans.

    >>> PartEdits(turn=1, settings={"dpi": 300}).settings_of(Settings()).dpi
    300.0
    """

    model_config = STRICT
    outline: Polygon | None = None
    masks: Annotated[tuple[Mask, ...], Field(max_length=50)] = ()
    turn: Annotated[int, Field(ge=0, le=3)] = 0
    rotate_deg: Annotated[float, Field(ge=-45, le=45)] = 0.0
    crop: Crop = Crop()
    size_mm: tuple[Annotated[float, Field(gt=0, le=3000)], Annotated[float, Field(gt=0, le=3000)]] | None = None
    settings: dict[str, Any] = {}
    label: Annotated[str, Field(max_length=80)] = ""

    @field_validator("settings")
    @classmethod
    def _are_settings(cls, settings: dict[str, Any]) -> dict[str, Any]:
        Settings.model_validate(settings)
        return settings

    def settings_of(self, settings: Settings) -> Settings:
        """Settings with those of this part in place of their own."""
        return Settings.model_validate({**settings.model_dump(), **self.settings}) if self.settings else settings

    def merged(self, over: PartEdits) -> PartEdits:
        """Merge with later ones, which win; masks add up, an empty list removes them."""
        fields = _fields(over)
        if over.masks:
            fields["masks"] = (*self.masks, *over.masks)
        if "settings" in fields:
            fields["settings"] = {**self.settings, **over.settings}
        return self.model_copy(update=fields)

    def without(self, others: PartEdits) -> PartEdits:
        """Drop the fields of others, and keep masks, since they add up."""
        rest = _dropped(self, others.model_fields_set - {"masks"})
        settings = {name: value for name, value in self.settings.items() if name not in others.settings}
        return rest.model_copy(update={"settings": settings}) if settings else rest

    def moved(self, move: Move) -> PartEdits:
        """Move the points to another image."""
        masks = tuple(mask.model_copy(update={"polygon": move(mask.polygon)}) for mask in self.masks)
        fields = {"outline": self.outline and move(self.outline), "masks": masks}
        return self.model_copy(update={name: value for name, value in fields.items() if value})


class By(BaseModel):
    """Who made the corrections, with which tool, and which restoration was shown."""

    model_config = STRICT
    operator: Annotated[str, Field(max_length=80)] = ""
    tool: Annotated[str, Field(max_length=40)] = ""
    saw: int | None = None


class PageEdits(BaseModel):
    """The corrections of one capture.

    scan        `sha512:…` of the file that they were made on; None for any.
    kind        what the scan shows; only a spread or a leaf can be split by itself.
    layout      auto, split, whole, left or right; the last two keep that leaf only.
    frame       of all points: pixels of the picture, or space, mm in the frame of the scan.
    spine       points from head to tail; None as found.
    overlap_mm  of the facing page, kept next to the spine.
    parts       `page`, `left`, `right` → their corrections.

    >>> PageEdits(layout="whole").canonical()[:33]
    b'{"by":{"operator":"","saw":null,"'
    """

    model_config = STRICT
    format: Literal["planish-edits"] = "planish-edits"
    version: Literal[1] = 1
    scan: Annotated[str, Field(pattern=r"^sha512:[0-9a-f]{128}$")] | None = None
    frame: Frame = "picture"
    kind: Kind | None = None
    layout: Literal["auto", "split", "whole", "left", "right"] = "auto"
    spine: Annotated[tuple[Point, ...], Field(min_length=2, max_length=16)] | None = None
    overlap_mm: Annotated[float, Field(ge=0, le=10)] = 1.0
    parts: Mapping[Part, PartEdits] = {}
    note: Annotated[str, Field(max_length=2000)] = ""
    by: By = By()

    @model_validator(mode="after")
    def _is_of_limited_size(self) -> Self:
        points = list(self.spine or ())
        for part in self.parts.values():
            points += [*(part.outline or ()), *(point for mask in part.masks for point in mask.polygon)]
        if len(points) > MAX_POINTS:
            raise ValueError(f"{len(points)} points are more than {MAX_POINTS}")
        if any(len(point) != COORDINATES[self.frame] for point in points):
            raise ValueError(f"points in {self.frame} have {COORDINATES[self.frame]} coordinates")
        return self

    def canonical(self) -> bytes:
        """Return the corrections as canonical JSON.

        Keys are sorted and points are to a hundredth: equal corrections have equal bytes.
        """
        return json.dumps(_rounded(self.model_dump(mode="json")), sort_keys=True, separators=(",", ":")).encode()

    def given(self) -> dict[str, Any]:
        """The fields that were given, as JSON values with points to a hundredth.

        >>> PageEdits(layout="auto", parts={"page": PartEdits(rotate_deg=0.456)}).given()
        {'layout': 'auto', 'parts': {'page': {'rotate_deg': 0.46}}}
        """
        return dict(_rounded(self.model_dump(mode="json", exclude_unset=True)))

    def of_image(self) -> dict[str, Any]:
        """Return what of the corrections changes the image, as JSON values.

        >>> PageEdits(note="later", by=By(operator="A. B."), parts={"page": PartEdits(label="7")}).of_image()
        {}
        """
        table = _rounded(self.model_dump(mode="json", exclude_defaults=True))
        parts = {name: _without(part, "label") for name, part in table.pop("parts", {}).items()}
        parts = {name: part for name, part in parts.items() if part}
        return _without(table, "scan", "note", "by") | ({"parts": parts} if parts else {})

    def part(self, name: str) -> PartEdits:
        """The corrections of a part; none for one that has none."""
        return dict(self.parts).get(name, PartEdits())  # type: ignore[call-overload]

    def merged(self, over: PageEdits) -> PageEdits:
        """Merge with later ones, which win field by field, as in `PartEdits.merged`.

        >>> PageEdits(layout="whole").merged(PageEdits(parts={"page": PartEdits(turn=1)})).given()
        {'layout': 'whole', 'parts': {'page': {'turn': 1}}}
        """
        own = self.parts
        parts = {name: own[name].merged(part) if name in own else part for name, part in over.parts.items()}
        return self.model_copy(update={**_fields(over), **({"parts": {**own, **parts}} if parts else {})})

    def without(self, others: PageEdits) -> PageEdits:
        """Drop the fields of others, and keep masks and who made the corrections."""
        parts = {name: part.without(others.part(name)) for name, part in self.parts.items()}
        return _with_parts(_dropped(self, others.model_fields_set - {"by"}), parts)

    def dropped(self, *names: str, of: Collection[str] = PARTS) -> PageEdits:
        """Drop fields of the page and of some of its parts.

        >>> PageEdits(layout="whole", parts={"page": PartEdits(turn=1)}).dropped("turn").given()
        {'layout': 'whole'}
        """
        parts = {name: _dropped(part, names) if name in of else part for name, part in self.parts.items()}
        return _with_parts(_dropped(self, names), parts)

    @property
    def has_points(self) -> bool:
        """Whether they have points on the image of their scan."""
        return bool(self.spine) or any(part.outline or part.masks for part in self.parts.values())

    def moved(self, move: Move) -> PageEdits:
        """Move the points to another image."""
        moved = self.model_copy(update={"spine": move(self.spine)}) if self.spine else self
        return _with_parts(moved, {name: part.moved(move) for name, part in self.parts.items()})

    def made_by(self, **fields: Any) -> PageEdits:
        """Name who made the corrections in place of who did before: fields of `By`."""
        return self.model_copy(update={"by": By.model_construct(**fields)})

    @property
    def names(self) -> tuple[str, ...]:
        """The fields that were given, as `layout` and `left.turn`."""
        own = (name for name in _fields(self) if name not in (*OF_THE_FILE, "parts"))
        return (*own, *(f"{name}.{field}" for name, part in self.parts.items() for field in _fields(part)))

    def check(self) -> None:
        """Raise BadInput for corrections that could not be read again once they are written."""
        parse_edits(json.dumps(self.given()).encode(), "the corrections")


Edits = TypeVar("Edits", PartEdits, PageEdits)


def _fields(model: BaseModel) -> dict[str, Any]:
    """Return the fields that were given."""
    given = model.model_fields_set
    return {name: value for name, value in vars(model).items() if name in given}


def _dropped(model: Edits, names: Collection[str]) -> Edits:
    return type(model)(**{name: value for name, value in _fields(model).items() if name not in names})


def _with_parts(edits: PageEdits, parts: Mapping[Part, PartEdits]) -> PageEdits:
    kept = {name: part for name, part in parts.items() if part.model_fields_set}
    return edits.model_copy(update={"parts": kept}) if kept else _dropped(edits, ("parts",))


def _without(table: Mapping[str, Any], *names: str) -> dict[str, Any]:
    return {name: value for name, value in table.items() if name not in names}


def _rounded(value: Any) -> Any:
    match value:
        case bool() | int() | str() | None:
            return value
        case float():
            return round(value, 2) + 0.0
        case dict():
            return {key: _rounded(item) for key, item in value.items()}
        case _:
            return [_rounded(item) for item in value]


def parse_edits(data: bytes, name: str) -> PageEdits:
    """Read corrections from JSON. name: of their file, for messages.

    Raises BadInput that names the field.

    >>> parse_edits(b'{"layout": "split"}', "book.edits.json").layout
    'split'
    """
    if len(data) > MAX_BYTES:
        raise BadInput(f"{name}: {len(data)} bytes are more than {MAX_BYTES}", HINT)
    try:
        table = json.loads(data, parse_constant=_refuse_constant)
    except RecursionError as error:
        raise BadInput(f"{name}: its values are nested too deeply", HINT) from error
    except ValueError as error:
        raise BadInput(f"{name} is not JSON: {error}", HINT) from error
    version = table.get("version") if isinstance(table, dict) else None
    if isinstance(version, int) and version > VERSION:
        raise BadInput(f"{name}: version {version} was made by a newer Planish", "update Planish to read it")
    try:
        return PageEdits.model_validate_json(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "it"
        raise BadInput(f"{name}: {where}: {first['msg']}", HINT) from error


def _refuse_constant(text: str) -> float:
    raise ValueError(f"{text} is not a number")
