"""What to know about the calibration of a page's scan: it is nominal, or old."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import date, datetime
from typing import Any

OLD_DAYS = 365  # an assumption: the drift of a real body was never measured
NOMINAL_TEXT = "nominal: sizes are uncertain by half a per cent (one standard deviation)"
CALIBRATE = "scan the marker board and run planish calibrate: see docs/how-to/calibrate-a-scanner.md"


@dataclass(frozen=True)
class Note:
    """What to know about a page that has no limits, and so no level. name: for programs."""

    name: str
    text: str
    hint: str


def age_days(measured_on: str, day: date) -> int:
    """Return how many days a calibration is old.

    >>> age_days("2026-01-31", date(2026, 2, 2))
    2
    """
    return (day - date.fromisoformat(measured_on)).days


def calibration_notes(report: Mapping[str, Any]) -> list[dict[str, str]]:
    """Return the notes on the calibration of a page as JSON values, from its report.

    The age is that on the day of the scan, so that it is the same whenever the verdict is derived again.

    >>> [note["name"] for note in calibration_notes({"calibration": {"kind": "nominal"}})]
    ['calibration_nominal']
    """
    calibration, source = report.get("calibration", {}), report.get("source", {})
    found: list[Note] = []
    if calibration.get("kind") == "nominal":
        found.append(Note("calibration_nominal", f"the calibration is {NOMINAL_TEXT}", CALIBRATE))
    try:
        days = age_days(calibration["date"], datetime.fromisoformat(source["time"]).date())
    except (KeyError, TypeError, ValueError):  # one of the two is not known
        days = 0
    if days > OLD_DAYS:
        text = f"the calibration was {days} days old when the page was scanned"
        found.append(Note("calibration_old", text, CALIBRATE))
    return [asdict(note) for note in found]
