"""What a canned station answers: `answers.json`, and what follows from a page's number."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np

from oracles.console.pictures import DPI, SHEET_MM, printed_page

Values = dict[str, Any]
ANSWERS: Values = json.loads((Path(__file__).parent / "answers.json").read_text("utf-8"))
TIME = ANSWERS["row"]["captured"]
RED, AMBER = 11, 7  # every so many pages
WORST: dict[str, dict[str, float]] = {"green": {}, "amber": {"blur_px": 1.51}, "red": {"cropped_fraction": 0.209}}
MM_PER_INCH = 25.4


def open_state(pages: int) -> Values:
    """The state of a station that works on a session of so many pages."""
    state: Values = copy.deepcopy(ANSWERS["state"])
    state["session"] |= {"pages": pages, "current": pages or None, "undo": {"step": "accept", "page": pages}}
    return state


def row(number: int) -> Values:
    """A page of the strip."""
    level = "red" if number % RED == 0 else "amber" if number % AMBER == 0 else "green"
    return {
        **ANSWERS["row"],
        **{"page": number, "position": number, "order": float(number), "label": str(number), "level": level},
        **{"side": "left" if number % 2 == 0 else "right", "accepted": number % 3 > 0, "marked": number % 8 == 0},
        "parts": [{"part": "page", "name": str(number), "label": str(number), "side": "", "tag": 0}],
        "rank": {"green": 0.0, "amber": 1.2, "red": 2.4}[level],
        **{"capture": 2 * number, "restore": 2 * number + 1},
    }


def leaf(number: int) -> Values:
    """A leaf of the contact sheet: one for each page, left and right in turn."""
    of = row(number)
    return {
        **{"name": str(number), "page": number, "part": "page", "label": of["label"], "side": of["side"], "kind": ""},
        **{
            "tag": 0,
            "position": number,
            "left_out": False,
            "missing": [],
            "run": None,
            "same": [],
            "event": of["restore"],
            "layer": "page",
        },
    }


def reviewed(number: int) -> Values:
    """A leaf of the review: what the contact sheet has of it, its size and its checks."""
    of = row(number)
    sizes = {"width_mm": SHEET_MM[0] + 0.1 * (number % 5), "height_mm": SHEET_MM[1], "sampling_ppi": 64.0, "dpi": DPI}
    return {**leaf(number), **sizes, "level": of["level"], "rank": of["rank"], "checks": detail(of, (1, 1))["checks"]}


def detail(of: Values, size: tuple[int, int]) -> Values:
    """All of a page of so many pixels: its findings, the worst first, and its layers."""
    worst = WORST.get(of["level"], {})
    findings = [
        {
            "page": None,
            "text": "",
            "hint": "",
            "name": name,
            **one,
            "level": "green",
            "less_is_worse": less_is_worse(one),
        }
        for name, one in ANSWERS["limits"].items()
    ]
    for finding in findings:
        if finding["name"] in worst:
            finding |= {"value": worst[finding["name"]], "level": of["level"]}
    findings.sort(key=lambda one: one["level"] == "green")
    layers = ["page", "master", "strain", "coverage", "uncertainty", "original"]
    own = [layer for layer in layers if layer != "original"]
    parts = [part["part"] for part in of.get("parts", ())] or ["page"]
    leaves = [
        {
            **{"part": part, "prefix": f"{part}." if len(parts) > 1 else "", "failed": None},
            **{"page_mm": list(SHEET_MM), "page_px": list(size), "dpi": DPI, "layers": own},
        }
        for part in parts
    ]
    event = {"number": 1, "kind": "capture", "name": "capture", "time": TIME, "software": "planish"}
    return {
        **of,
        "leaves": leaves,
        "before": {"event": of["restore"] - 1, "leaves": leaves} if of["restore"] else None,
        "notes": [{"name": "calibration_nominal", "text": "", "hint": ""}],
        **{"checks": findings, "report": {}, "page_mm": list(SHEET_MM), "page_px": list(size), "dpi": DPI},
        **{"layers": layers, "models": ["scan", "mesh", "steps"], "words": True},
        "shots": [{"capture": of["capture"], "time": TIME, "current": True, "size_bytes": 10**6}],
        **{"events": [event], "files": [{"event": of["restore"], "name": "page.png", "bytes": 812_345}]},
    }


def less_is_worse(check: Values) -> bool:
    """Whether a check is worse for smaller values."""
    amber, red = check["limits"]
    return bool(amber > red)


def preview() -> Values:
    """A preview with its aids: a bright page, a dark table."""
    levels = np.arange(256)
    grey = (9000 * np.exp(-((levels - 205) ** 2) / 300) + 900 * np.exp(-((levels - 40) ** 2) / 900)).astype(int)
    shifted = {"r": np.roll(grey, 4), "g": grey, "b": np.roll(grey, -8), "grey": grey}
    return {**ANSWERS["preview"], "histogram": {name: counts.tolist() for name, counts in shifted.items()}}


def words() -> list[Values]:
    """The words of the page, boxes in px, each in a line of its own."""
    found, height = printed_page(), SHEET_MM[1]
    boxes = [(word.text, np.multiply(word.box, DPI / MM_PER_INCH)) for word in found.words]
    bottom = height * DPI / MM_PER_INCH
    return [
        {"text": text, "x": x, "y": bottom - top, "w": right - x, "h": top - low, "line": at}
        for at, (text, (x, low, right, top)) in enumerate(boxes)
    ]
