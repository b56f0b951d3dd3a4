"""Every key of reports, presets, events and configuration: its type, its unit and its one meaning.

Those of reports are in `restore/report.py`, quality measures in `station/verdict/table.py`.

A name stands for one thing wherever it occurs. In `thresholds` a measure has its two limits in place of its value.
GENERIC names are words that need the table they stand in, as `max` of `strain` and of `illumination_gain`; OPEN tables
have keys that are values themselves, as the stages in `seconds`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, NamedTuple, NotRequired, get_args, get_origin, get_type_hints, is_typeddict

from restore.report import PhotogrammetryReport, Report
from station.verdict.table import MEASURES


class Key(NamedTuple):
    """A key of a public file. type: of JSON, a list as `[number]`; null where a value may be missing."""

    type: str
    unit: str
    meaning: str


GENERIC: Mapping[str, str] = {
    "name": "name of the thing that the table is about",
    "text": "a sentence for the operator",
    "hint": "what to do about it",
    "error": "why a scan could not be restored",
    "reason": "why it is so",
    "value": "the value that was decided or measured",
    "min": "smallest value",
    "max": "greatest value, of strain the greatest absolute one",
    "mean": "mean value",
    "rms": "root of the mean square",
}
OPEN = frozenset({"seconds", "files", "calibration", "scanner", "camera", "rejected", "uncertainty_mm"})
"""Tables whose own keys are not listed: stages, paths, parts of one figure, or what a driver or a camera model
defines."""
TYPES: Mapping[Any, str] = {int: "number", float: "number", str: "text", bool: "flag", NoneType: "null", list: "list"}


class Field(NamedTuple):
    """A key of the report: its name after those of its tables, its annotation and its meaning."""

    path: tuple[str, ...]
    type: Any
    meaning: str


def fields_of(table: Any, above: tuple[str, ...] = ()) -> Iterator[Field]:
    """The keys of a table of the report, and of those in it."""
    for name, hint in get_type_hints(table, include_extras=True).items():
        bare = get_args(hint)[0] if get_origin(hint) is NotRequired else hint
        kind, *texts = get_args(bare) if get_origin(bare) is Annotated else (bare,)
        yield Field((*above, name), kind, *texts or [""])
        inner = get_args(kind)[0] if get_origin(kind) is list else kind
        if is_typeddict(inner):
            yield from fields_of(inner, (*above, name))


def json_type(kind: Any) -> str:
    """The type of a JSON value, of an annotation.

    >>> json_type(list[float] | None)
    '[number]|null'
    """
    if get_origin(kind) is UnionType:
        return "|".join(json_type(one) for one in get_args(kind))
    if get_origin(kind) is list:
        (item,) = get_args(kind)
        return f"[{TYPES[list] if get_origin(item) is list else json_type(item)}]"
    return TYPES.get(kind, "table")


def _of_reports() -> dict[str, Key]:
    """The keys of reports. Raises ValueError for one of two meanings."""
    found: dict[str, Key] = {}
    for field in (*fields_of(Report), *fields_of(PhotogrammetryReport)):
        key, name = Key(json_type(field.type), "", field.meaning), field.path[-1]
        if key.meaning and name not in GENERIC and found.setdefault(name, key) != key:
            raise ValueError(f"{name} is {key.meaning}, and {found[name].meaning}")
    return found


REPORT_KEYS = _of_reports()
KEYS: Mapping[str, Key] = REPORT_KEYS | {
    # A restored page
    "uncertainty": Key("flag", "", "estimate the uncertainty of places on the page"),
    "peak_memory_mb": Key("number", "MB", "peak memory of the process"),
    "files": Key("[text]|table", "", "names of written files; in events with their SHA-512"),
    "scan": Key("text", "", "path of the scan that was restored or captured"),
    "texture": Key("text", "", "path of a separate source image"),
    "extra_scans": Key("[text]", "", "paths of the further scans for super-resolution"),
    "photographs": Key("[text]", "", "paths of the photographs of a page"),
    "views": Key("[text]", "", "paths of the turntable views"),
    "sheets": Key("[table]", "", "reports of the sheets of one scan"),
    "sheet": Key("table", "", "which sheet of a scan the page is"),
    "of": Key("number", "", "how many sheets the scan has"),
    "parts": Key("table", "", "leaves of an opened book, each with its report or its corrections"),
    "layout": Key("table|text", "", "layout of a scan as it was found, or as it is requested"),
    "rejected": Key("[table]|table", "", "what was not used, with the reason"),
    # Quality measures and their limits in presets
    "measures": Key("table", "", "measures of the quality check"),
    **{one.name: Key("number|null|[number]", one.unit, one.definition) for one in MEASURES.values()},
    "fingerprint": Key("text", "", "print of the page, small, to compare"),
    "checks": Key("[table]", "", "measures with their limits"),
    "notes": Key("[table]", "", "what to know about a page that has no limits"),
    "limits": Key("[number]", "", "amber and red limit of a measure"),
    "thresholds": Key("table", "", "limits of each measure"),
    "level": Key("text", "", "green, amber or red"),
    "white_balance": Key("table|text", "", "colour of the light: keep, paper or a profile"),
    # Provenance of a scan
    "provenance": Key("table", "", "provenance of the scan, as captured"),
    "device": Key("text", "", "scanner or method of the scan"),
    "profile": Key("text", "", "name of the command profile"),
    "body": Key("text", "", "serial number of the scanner"),
    "lens": Key("text", "", "TELE, MIDDLE or WIDE"),
    "lens_serial": Key("text", "", "serial number of the lens"),
    "mode": Key("text", "", "fast or fine"),
    "distance_mm": Key("number", "mm", "focus distance from the lens"),
    "distances_mm": Key("[number]", "mm", "focus distances of a capture in several depths"),
    "laser_power": Key("number", "1 to 255", "laser power"),
    "gain": Key("number", "0 to 7", "gain of the sensor"),
    "average": Key("number", "", "captures that are averaged"),
    "integrity": Key("text", "", "checksum, read_twice or read_once"),
    "unchecked": Key("[text]", "", "checks that the command profile does not allow"),
    "time": Key("text", "ISO 8601, UTC", "when it was made"),
    "super_resolution": Key("table", "", "how captures were combined"),
    "captures": Key("number|[number]|text", "", "captures that were combined; of a rule its scans, or all"),
    "factor": Key("number", "1", "pixels per source pixel along a side"),
    "shifts_px": Key("[list]", "pixels", "shift of each capture"),
    "turntable": Key("table", "", "turntable: its configuration, or angle and axis of a view"),
    "deg": Key("number", "degrees", "angle of the turntable"),
    "axis": Key("table|null", "", "axis of the turntable in the frame of the scanner"),
    "point_mm": Key("[number]", "mm", "a point on the axis"),
    "direction": Key("[number]|text", "", "direction of the axis, or of reading: ltr, rtl"),
    # Presets and settings
    "settings": Key("table", "", "settings of a restoration"),
    "inpaint_mm": Key("number", "mm", "width up to which occluded places are inpainted"),
    "outputs": Key("[text]", "", "further files that are written"),
    "language": Key("text", "", "language of the text as a Tesseract code"),
    "foliation": Key("text", "", "pages, folios or none"),
    "first": Key("number", "", "number of the first page or leaf"),
    "sides": Key("text", "", "side of the first page: left or right"),
    "size_mm": Key("[number]", "mm", "width and height of a leaf, by hand"),
    "overlap_mm": Key("number", "mm", "facing page that a leaf keeps"),
    "rotate": Key("text", "degrees", "rotation that is requested, or auto"),
    "allow_distorted": Key("flag", "", "write a page whose surface is too distorted"),
    "unit": Key("text", "", "unit of mesh coordinates"),
    "grid": Key("text", "", "columns x rows of an organised cloud, or auto"),
    "depth": Key("text", "", "depths of an image: axis, ray or auto"),
    "scale": Key("text|null", "", "where the scale is from: card, none or width x height"),
    # Events of a session
    "number": Key("number", "", "running number of an event, or of a sheet"),
    "page": Key("number", "", "running number of the page, 0 for the volume"),
    "kind": Key("text", "", "of an event: session, capture, stage, decision or move; of a page: what it shows"),
    "slot": Key("text", "", "the pointer that the event sets"),
    "parent": Key("number|null", "", "the event that the pointer named before"),
    "software": Key("text", "", "name and version of the program"),
    "facts": Key("table", "", "what the event records"),
    "inputs": Key("[table]", "", "events that a stage read"),
    "format": Key("number", "", "format of the record"),
    "event": Key("number", "", "number of an event that was read"),
    "sha512": Key("text", "", "SHA-512 of its record"),
    "parameters": Key("table", "", "all that a run depends on besides its input"),
    "result": Key("table", "", "what follows from input and parameters"),
    "by": Key("text", "", "program that captured the scan"),
    "to": Key("number|null", "", "event that a pointer names from now on"),
    "id": Key("text", "", "identifier of the session"),
    "volume": Key("table", "", "what the session is of"),
    "title": Key("text", "", "title of the volume"),
    "project": Key("text", "", "collection or order"),
    "organisation": Key("text", "", "institution that holds the volume"),
    "scope": Key("table", "", "pages of a rule"),
    "future": Key("flag", "", "whether a rule is also on later pages"),
    "side": Key("text", "", "side of a leaf, or of the parts of a rule"),
    "style": Key("text", "", "style of a run of labels"),
    "prefix": Key("text", "", "before each number of a run"),
    "suffix": Key("text", "", "after each number of a run"),
    "bracket": Key("flag", "", "whether the numbers of a run are inferred"),
    "counted": Key("flag", "", "whether the leaves of a run have labels"),
    "preset": Key("text", "", "name of the preset"),
    "preset_values": Key("table", "", "the preset as it was at the beginning"),
    "station": Key("text", "", "configuration of the station"),
    "photogrammetry": Key("table", "", "a page from photographs alone"),
    # Configuration
    "scanner": Key("table", "", "settings of the driver that `driver` names"),
    "capture": Key("table", "", "settings of a capture"),
    "restore": Key("table", "", "settings of a restoration"),
    "output": Key("table", "", "names of written files"),
    "stem": Key("text", "", "first part of the names of files"),
    "model": Key("text", "", "model of the turntable controller"),
    "port": Key("text", "", "serial port of the controller"),
    "relative": Key("flag", "", "whether the controller takes relative rotations"),
    "arc_deg": Key("number", "degrees", "angle that the views cover"),
    "multi_depth": Key("flag", "", "captures in several depths"),
    "deadline_s": Key("number|null", "s", "time limit of a capture"),
}


def keys_of(value: Any) -> Iterator[tuple[str, Any]]:
    """Every key of nested tables and lists of them, with its value; those of OPEN tables are left out."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield str(key), item
            if key not in OPEN:
                yield from keys_of(item)
    elif isinstance(value, list | tuple):
        for item in value:
            yield from keys_of(item)


def type_of(value: Any) -> str:
    """The type of a JSON value as KEYS has it."""
    match value:
        case None:
            return "null"
        case bool():
            return "flag"
        case int() | float():
            return "number"
        case str():
            return "text"
        case Mapping():
            return "table"
        case list() | tuple():
            return f"[{type_of(value[0]) if value else ''}]".replace("[[", "[list").partition("]")[0] + "]"
    raise TypeError(f"{type(value).__name__} is not a JSON value")
