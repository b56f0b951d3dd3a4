"""Read corrections as an operator writes them: `turn=1`, `spine=320,18:321,461`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from restore import BadInput, PageEdits, PartEdits, Settings
from station.errors import UsageError
from station.session.terms.rules import edits_of

MASKS = ("remove", "keep")
SETTING = "settings."  # before the name of a setting of a part


class Field(NamedTuple):
    """A field of corrections. form: how an operator writes its value."""

    key: str
    read: Callable[[str], Any]
    of_part: bool
    form: str


def _number(text: str) -> float:
    return float(text)


def _points(text: str) -> list[list[float]]:
    points = [[float(number) for number in point.split(",")] for point in text.split(":")]
    if any(len(point) != 2 for point in points):
        raise ValueError("a point has two coordinates")
    return points


def _crop(text: str) -> dict[str, Any]:
    mode, _, rest = text.partition(":")
    if mode == "margin":
        return {"mode": mode, "margin_mm": float(rest)}
    return {"mode": mode, "box": [float(side) for side in rest.split(",")]} if mode == "box" else {"mode": mode}


def _size(text: str) -> list[float]:
    width, _, height = text.lower().replace("×", "x").partition("x")
    return [float(width), float(height)]


FIELDS: Mapping[str, Field] = {
    "kind": Field("kind", str, False, "leaf, spread, plate, cover, foldout, insert, target or blank"),
    "layout": Field("layout", str, False, "auto, split, whole, left or right"),
    "spine": Field("spine", _points, False, "X,Y:X,Y… from head to tail, pixels of the image"),
    "overlap": Field("overlap_mm", _number, False, "mm of the facing page"),
    "note": Field("note", str, False, "text"),
    "outline": Field("outline", _points, True, "X,Y:X,Y:X,Y… in pixels of the image"),
    "remove": Field("masks", _points, True, "X,Y:X,Y:X,Y…, one more area to remove"),
    "keep": Field("masks", _points, True, "X,Y:X,Y:X,Y…, one more area of paper"),
    "turn": Field("turn", int, True, "quarters clockwise: 0, 1, 2 or 3"),
    "rotate": Field("rotate_deg", _number, True, "degrees clockwise, at most 45"),
    "crop": Field("crop", _crop, True, "paper, margin:MM or box:LEFT,TOP,RIGHT,BOTTOM in mm"),
    "size": Field("size_mm", _size, True, "WIDTHxHEIGHT of the leaf in mm"),
}


def changed(edits: PageEdits, words: Iterable[str], parts: Sequence[str]) -> PageEdits:
    """Return corrections with fields set, or taken away where nothing follows the sign.

    words: `FIELD=VALUE` or `FIELD=`. parts: those that fields of parts are set on.
    Raises UsageError for a field that does not exist, BadInput for a value that cannot be.
    """
    for word in words:
        name, sign, value = word.partition("=")
        if not sign or (name not in FIELDS and not name.startswith(SETTING)):
            raise UsageError(
                f"{word!r} sets no field", f"write FIELD=VALUE with one of {', '.join(FIELDS)}, {SETTING}…"
            )
        edits = _set(edits, name, value, parts)
    edits.check()
    return edits


def parse_points(name: str, text: str) -> list[list[float]]:
    """Return the points of a field as an operator writes them. Raises BadInput."""
    try:
        return _points(text)
    except ValueError as error:
        raise BadInput(f"{name}: {text!r} cannot be read", f"write {FIELDS[name].form}") from error


def _set(edits: PageEdits, name: str, text: str, parts: Sequence[str]) -> PageEdits:
    if name.startswith(SETTING):
        name = name.removeprefix(SETTING)
        given = PartEdits.model_construct(settings={name: _setting(name, text) if text else None})
        of_parts: Any = dict.fromkeys(parts, given)
        one = PageEdits.model_construct(parts=of_parts)
        return edits.merged(one) if text else edits.without(one)
    key, read, of_part, form = FIELDS[name]
    if not text:
        return edits.dropped(key, of=parts)
    try:
        value = read(text)
    except ValueError as error:
        raise BadInput(f"{name}: {text!r} cannot be read", f"write {form}") from error
    table = {key: [{"what": name, "polygon": value}] if name in MASKS else value}
    return edits.merged(edits_of({"parts": dict.fromkeys(parts, table)} if of_part else table))


def _setting(name: str, text: str) -> Any:
    """Return a setting of the restoration as its JSON value. Raises BadInput."""
    try:
        return Settings.model_validate_strings({name: text}).model_dump(mode="json", include={name})[name]
    except (ValueError, LookupError) as error:
        raise BadInput(f"{SETTING}{name}: {text!r} is not allowed", "see docs/reference/configuration.md") from error
