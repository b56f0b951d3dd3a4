"""The report of a run: a JSON file, and a summary of several lines."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from restore import Finding

Report = Mapping[str, Any]

INTEGRITY = {
    "checksum": "checksummed in transfer",
    "read_twice": "read twice from the scanner, which sends no checksums",
    "read_once": "read once, without checksums: damage in transfer is not detected",
}
"""`source.integrity` of a report → the words of the summary."""


def encode_report(report: Report) -> str:
    """The report as strict JSON."""
    return json.dumps(report, indent=2, allow_nan=False) + "\n"


def summary(report: Report, files: Iterable[Path]) -> str:
    """The summary of a report, one line a value."""
    width, height = report["page_mm"]
    rows = [
        ("page", f"{width:.1f} × {height:.1f} mm at {report['dpi']:g} dpi, shading: {report['shading']}"),
        *(("white", text) for text in _white(report.get("white_balance", {}))),
        ("source", _resolution(report)),
        *(("samples", text) for key, text in INTEGRITY.items() if report.get("source", {}).get("integrity") == key),
        ("flattened", f"{report['points']} points by {report['method']} in {report['iterations']} iterations"),
        ("strain", _strain(**report["strain"])),
        *(("size", text) for text in _size(report)),
        ("area", f"ratio {report['area_ratio']:.4f}, {report['flipped_faces']} flipped faces"),
        ("seconds", ", ".join(f"{stage} {seconds:.2f}" for stage, seconds in report["seconds"].items())),
        *(("photo", _photo(photo)) for photo in report.get("photos", ()) if photo["accepted"]),
        ("memory", f"{report['peak_memory_mb']:.0f} MB at most"),
        *((one.severity, one.text) for one in Finding.all_in(report)),
        *(("file", str(path)) for path in files),
    ]
    return "\n".join(f"{name:<10} {text}" for name, text in rows)


def _strain(*, smooth_rms: float, rms: float, **_: Any) -> str:
    """Return the text on the strain as a whole, and of single edges.

    Their lengths over creases are estimates.
    """
    return f"{smooth_rms:.3%} rms of the page as a whole, {rms:.3%} rms of its edges"


def _size(report: Report) -> list[str]:
    """How well the size of a page and the places on it are known, as far as the report says."""
    known, stated = report.get("size_mm_ci95"), report.get("uncertainty_mm", {})
    kind = report.get("calibration", {}).get("kind", "unknown")
    lines = [f"known to ± {known[0]:.2f} × {known[1]:.2f} mm (95 %), calibration {kind}"] if known else []
    if "reason" in stated:
        lines.append(f"uncertainty not estimated: {stated['reason']}")
    elif stated:
        lines.append(f"places uncertain by {stated['total']:.3f} mm rms, 95 % within {stated['p95']:.3f} mm")
    return lines


def _resolution(report: Report) -> str:
    """What the source of a page, or a photograph, resolves."""
    ppi, sampling = report["resolved_ppi"], report.get("sampling_ppi")
    if ppi:
        return f"resolves {ppi:.0f} pixels per inch"
    return f"{sampling:.0f} pixels per inch; what they resolve cannot be measured" if sampling else "no colour image"


def left_out(pieces: Iterable[Report]) -> list[str]:
    """Return a line for each piece of a scan that is not a page."""
    return [f"{'warning':<10} piece {one['number']} of {one['of']} is skipped: {one['reason']}" for one in pieces]


def _white(white: Report) -> list[str]:
    """What was done to the colour of the light, if anything."""
    if white.get("setting") == "profile":
        return [f"converted to sRGB by the profile {white['icc_profile']}"]
    if white.get("balanced"):
        return ["bare paper made neutral; it was sRGB {}, {}, {}".format(*white["paper"])]
    return []


def _photo(photo: Report) -> str:
    return (
        f"{photo['name']} gives {photo['textured_fraction']:.0%} of the page and {_resolution(photo)}, "
        f"registered to {photo['residual_px']:.1f} pixels rms"
    )


def finite(value: Any) -> Any:
    """The value with None for every number that JSON cannot represent: NaN, infinity."""
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
