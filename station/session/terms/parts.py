"""Name the stages of a page, and the parts of a restoration.

A part is the whole page of a scan, or one of its leaves.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from station.errors import UsageError

RESTORE, VERDICT = STAGES = "restore", "verdict"
PAGE, LEFT, RIGHT = PARTS = "page", "left", "right"
STEM = "page"  # first part of the names of a restoration's files
Report = Mapping[str, Any]


def parts_of(result: Report) -> dict[str, Report]:
    """Return part → report, of the result of a restoration.

    A whole that is kept next to its leaves is left out.

    >>> parts_of({"part": "right"}), list(parts_of({"parts": {"left": {}, "right": {}, "page": {}}}))
    ({'right': {'part': 'right'}}, ['left', 'right'])
    """
    parts: Report = result.get("parts", {})
    return {name: parts[name] for name in (LEFT, RIGHT) if name in parts} or {_only(result): result}


def measured_parts(result: Report) -> dict[str, Report]:
    """Part → measures, of the parts that could be restored."""
    return {name: report["measures"] for name, report in parts_of(result).items() if "measures" in report}


def errors_of(result: Report) -> Iterator[tuple[str, str, str]]:
    """Part, reason and hint, of the parts that could not be restored."""
    for name, report in parts_of(result).items():
        if "error" in report:
            yield name, str(report["error"]), str(report.get("hint", ""))


def part_of_file(name: str) -> tuple[str, str]:
    """The part that a file of a restoration is of, and the ending of its name.

    >>> part_of_file("page.png"), part_of_file("page-left-coverage.png")
    (('page', '.png'), ('left', '-coverage.png'))
    """
    ending = name.removeprefix(STEM)
    for part in (LEFT, RIGHT):
        if ending.startswith((f"-{part}-", f"-{part}.")):
            return part, ending.removeprefix(f"-{part}")
    return PAGE, ending


def leaf_name(page: int, part: str) -> str:
    """The name of a part of a page: `12`, `12/left`.

    >>> leaf_name(12, "page"), leaf_name(12, "left")
    ('12', '12/left')
    """
    return str(page) if part == PAGE else f"{page}/{part}"


def _only(result: Report) -> str:
    part = result.get("part")
    return part if part in PARTS else PAGE


LEAF = re.compile(r"(?P<page>[1-9]\d{0,3})(?:/(?P<part>left|right))?")


RANGE = re.compile(r"(?P<first>[1-9]\d{0,3})(?:-(?P<last>[1-9]\d{0,3}))?")


def parse_leaf(text: str) -> tuple[int, str | None]:
    """Return page and part of `12`, `12/left`. Raises UsageError.

    >>> parse_leaf("12/left"), parse_leaf("3")
    ((12, 'left'), (3, None))
    """
    match = LEAF.fullmatch(text)
    if match is None:
        raise UsageError(f"{text!r} is not a page", "write its number, and /left or /right for a leaf: 12/left")
    return int(match["page"]), match["part"]


def parse_pages(text: str) -> list[int]:
    """Return the numbers of `3,5-8`. Raises UsageError.

    >>> parse_pages("3,5-8")
    [3, 5, 6, 7, 8]
    """
    matches = [RANGE.fullmatch(part.strip()) for part in text.split(",")]
    if None in matches:
        raise UsageError(f"{text!r} are not pages", "write their numbers: 3,5-8")
    found = [range(int(one["first"]), int(one["last"] or one["first"]) + 1) for one in matches if one]
    return [number for numbers in found for number in numbers]


def parts_to_correct(leaf_parts: Sequence[str], part: str | None) -> list[str]:
    """Return the parts that a correction is of: the named one, or those that a page has."""
    return [part] if part else [name for name in PARTS if name in leaf_parts]
