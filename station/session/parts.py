"""Name the stages of a page, and the parts of a restoration.

A part is the whole page of a scan, or one of its leaves.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from station.session.events import Event

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


def file_of(event: Event, part: str, ending: str = ".png") -> str | None:
    """The name of a file of a part in a restoration; None where it has none.

    ending: what follows the stem, as `-coverage.png`.
    """
    alone = len(parts_of(event.facts["result"])) == 1
    name = STEM + ("" if alone or part == PAGE else f"-{part}") + ending
    return name if name in event.files else None


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
