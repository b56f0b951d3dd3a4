"""Every key of reports, presets, events and configuration: its type, its unit, its one meaning, and where it is made.

A name stands for one thing wherever it occurs. In `thresholds` a measure has its two limits in place of its value.
GENERIC names are words that need the table they stand in, as `max` of `strain` and of `illumination_gain`; OPEN tables
have keys that are values themselves, as the stages in `seconds`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from station.verdict.table import MEASURES


class Key(NamedTuple):
    """A key of a public file. type: of JSON, a list as `[number]`; null where a value may be missing.

    made: the module that writes it, or the model that reads it.
    """

    type: str
    unit: str
    meaning: str
    made: str


REPORT = "restore/report.py"
COVERAGE = "restore/texture/coverage.py"
MEASURED = "station/verdict/measures.py"
TABLE = "station/verdict/table.py"
PHOTO = "restore/photo/page.py"
RESOLUTION = "restore/texture/resolution.py"
SHEET = "restore/prepared/facet_sheet.py"
ADJUST = "restore/photogrammetry/track_and_adjust.py"
GRAMMETRY = "restore/photogrammetry/reconstruct.py"
SURFACE = "restore/photogrammetry/surfaces/surface.py"
LIGHT = "restore/shading/remove.py"
CAMERA = "drivers/vivid900/capture/camera.py"
LAYOUT = "restore/layout/finding.py"
RUN = "station/run/one_page.py"
EVENTS = "station/session/log/events.py"
STEPS = "station/session/log/steps.py"
PRESETS = "station/session/terms/presets.py"
CONFIG = "station/config.py"
CHECKS = "station/verdict/checks.py"
VOLUME = "station/session/terms/volume.py"

KEYS: Mapping[str, Key] = {
    # A restored page
    "points": Key("number", "", "vertices of the mesh that is flattened; in settings 0 keeps all", REPORT),
    "method": Key("text", "", "flattening method", REPORT),
    "dpi": Key("number", "pixels per inch", "resolution of the page", REPORT),
    "uncertainty": Key("flag", "", "estimate the uncertainty of places on the page", "restore/settings.py"),
    "uncertainty_mm": Key(
        "table", "mm", "standard deviations of places on a page, and what 95 % stay within", "restore/pipeline.py"
    ),
    "size_mm_ci95": Key("[number]", "mm", "half of the 95 % intervals of width and height", "restore/pipeline.py"),
    "shading": Key("text", "", "keep or remove light and shadow", REPORT),
    "iterations": Key("number", "", "iterations or time steps of the flattening", REPORT),
    "flipped_faces": Key("number", "", "faces of the flat mesh that lie upside down", REPORT),
    "folded_faces": Key("number", "", "faces of the surface that are turned against their neighbours", REPORT),
    "area_ratio": Key("number", "1", "area of the flat mesh over that of the surface", REPORT),
    "convergence": Key("table", "", "how far the solver came", REPORT),
    "residual": Key("number", "1", "rms strain that single vertices could still be relieved of", "restore/page.py"),
    "converged": Key("flag", "", "whether the solver reached its tolerance", "restore/page.py"),
    "strain": Key("table", "", "relative change of edge lengths by the flattening", REPORT),
    "smooth_rms": Key("number", "1", "rms strain of the page as a whole", REPORT),
    "faces": Key("table", "", "strain of the faces, weighted by area", REPORT),
    "stretch": Key("table", "1", "greatest stretch of each face", REPORT),
    "shear": Key("table", "1", "shear of each face", REPORT),
    "chord_strain": Key("table", "", "strain against straight edge lengths", REPORT),
    "estimate_rms": Key("number", "1", "rms difference of rest lengths and straight lengths", REPORT),
    "estimated_fraction": Key("number", "1", "fraction of edges whose length is an estimate", REPORT),
    "max_difference_at_mm": Key("[number]", "mm", "place of the greatest such difference on the page", REPORT),
    "page_mm": Key("[number]", "mm", "width and height of the page", REPORT),
    "decimation_error_mm": Key("table", "mm", "depth between the decimated mesh and the surface", REPORT),
    "mean_mm": Key("number", "mm", "mean of a distance", "restore/range_image/facets/sheet.py"),
    "sd_mm": Key("number", "mm", "standard deviation of a distance", "restore/range_image/facets/sheet.py"),
    "max_mm": Key("number", "mm", "greatest value of a distance", "restore/range_image/facets/sheet.py"),
    "resolved_ppi": Key("number|null", "pixels per inch", "resolution by the MTF", RESOLUTION),
    "resolved_ppi_unknown": Key("text", "", "why the MTF is not measured", RESOLUTION),
    "mtf50_per_mm": Key("number|null", "1/mm", "frequency at half contrast", RESOLUTION),
    "samples": Key("number", "", "measured samples on the page", SHEET),
    "interpolated_fraction": Key("number", "1", "fraction of the surface without range", SHEET),
    "rotation_deg": Key("number", "degrees", "clockwise rotation of the page", "restore/orientation.py"),
    "mirrored": Key("flag", "", "whether the page was mirrored", "restore/orientation.py"),
    "findings": Key("[table]", "", "notes, warnings and doubts about the page", "restore/findings.py"),
    "code": Key("text", "", "which finding it is: a key of its table of codes", "restore/findings.py"),
    "severity": Key("text", "", "note, warning or doubt", "restore/findings.py"),
    "share": Key("number|null", "1", "fraction that a finding is about", "restore/findings.py"),
    "seconds": Key("table", "s", "time of each stage", RUN),
    "peak_memory_mb": Key("number", "MB", "peak memory of the process", RUN),
    "files": Key("[text]|table", "", "names of written files; in events with their SHA-512", RUN),
    "scan": Key("text", "", "path of the scan that was restored or captured", RUN),
    "texture": Key("text", "", "path of a separate source image", RUN),
    "extra_scans": Key("[text]", "", "paths of the further scans for super-resolution", RUN),
    "photographs": Key("[text]", "", "paths of the photographs of a page", "station/run/photos.py"),
    "views": Key("[text]", "", "paths of the turntable views", "station/run/turntable.py"),
    "sheets": Key("[table]", "", "reports of the sheets of one scan", RUN),
    "sheet": Key("table", "", "which sheet of a scan the page is", "station/run/pieces.py"),
    "of": Key("number", "", "how many sheets the scan has", "station/run/pieces.py"),
    "part": Key("text", "", "leaf of an opened book: left, right, or page for the whole", "restore/layout/leaves.py"),
    "parts": Key(
        "table",
        "",
        "leaves of an opened book, each with its report or its corrections",
        "station/session/derivation/restoration.py",
    ),
    "layout": Key(
        "table|text", "", "layout of a scan as it was found, or as it is requested", "restore/layout/leaves.py"
    ),
    "given": Key("[text]", "", "sides placed by the given size", "restore/edits/finish.py"),
    "edits": Key("table", "", "corrections by hand of the page", "restore/edits/model.py"),
    "leaf_mm": Key("[number]", "mm", "size of a leaf without the strip of the facing page", "restore/pipeline.py"),
    "advice": Key("text", "", "split, whole, left, right or ask", LAYOUT),
    "is_spine": Key("text", "", "whether a valley is a spine: sure, unsure or no", LAYOUT),
    "spine": Key("[table]|null", "pixels or mm", "points of the spine from head to tail", LAYOUT),
    "frame": Key("text", "", "picture or page: where the spine is given", LAYOUT),
    "sigma_mm": Key("number|null", "mm", "standard deviation of the place of the spine", LAYOUT),
    "turn_deg": Key("number", "degrees", "turn of the surface across the spine", LAYOUT),
    "beyond_deg": Key("number", "degrees", "turn of the surface next to the spine", LAYOUT),
    "bands": Key("number", "1", "fraction of the height in which the spine was found", LAYOUT),
    "crossing": Key("number|null", "1", "fraction of the height at which print runs over the spine", LAYOUT),
    "widths_mm": Key("[number]|null", "mm", "width left and right of the spine", LAYOUT),
    "gutter_hidden_mm": Key("number", "mm", "least width of paper at the spine without range", LAYOUT),
    "reasons": Key("[text]", "", "why the advice is given", LAYOUT),
    "rejected": Key("[table]|table", "", "what was not used, with the reason", RUN),
    # Coverage: fractions of the page's area
    "coverage": Key("table", "", "fractions of the page by kind of pixel", COVERAGE),
    "measured": Key("number", "1", "seen by the camera, shape measured", COVERAGE),
    "interpolated": Key("number", "1", "seen by the camera, shape interpolated", COVERAGE),
    "occluded": Key("number", "1", "not seen by the camera", COVERAGE),
    "inpainted": Key("number", "1", "occluded, and inpainted", COVERAGE),
    "obstructed": Key("number", "1", "covered by something in a photograph", COVERAGE),
    "facing": Key("number", "1", "of the facing page, next to the spine", COVERAGE),
    "erased": Key("number", "1", "removed by hand", COVERAGE),
    # Quality measures and their limits in presets
    "measures": Key("table", "", "measures of the quality check", MEASURED),
    **{one.name: Key("number|null|[number]", one.unit, one.definition, TABLE) for one in MEASURES.values()},
    "fingerprint": Key("text", "", "print of the page, small, to compare", MEASURED),
    "checks": Key("[table]", "", "measures with their limits", CHECKS),
    "notes": Key("[table]", "", "what to know about a page that has no limits", "station/verdict/calibration_notes.py"),
    "limits": Key("[number]", "", "amber and red limit of a measure", CHECKS),
    "thresholds": Key("table", "", "limits of each measure", PRESETS),
    "level": Key("text", "", "green, amber or red", CHECKS),
    # Light
    "light": Key("table", "", "illumination correction", "restore/pipeline.py"),
    "removed": Key("flag", "", "whether light and shadow were removed", LIGHT),
    "corrected": Key("flag", "", "whether a residual corrects the fitted light", LIGHT),
    "regions_fraction": Key("number", "1", "fraction of the page in regions of constant print", LIGHT),
    "lamps": Key("number", "", "lamps of the fitted light", LIGHT),
    "fitted_to": Key("text", "", "what the light was fitted to", LIGHT),
    "variation": Key("number", "1", "variation of the light over the page", LIGHT),
    "standard_error": Key("number", "1", "standard error of the light", LIGHT),
    "unevenness_before": Key("number", "1", "variation of bare paper before the correction", LIGHT),
    "unevenness": Key("number", "1", "variation of bare paper after the correction", LIGHT),
    "illumination_gain": Key("table", "1", "factors of the correction", LIGHT),
    "paper_fraction": Key("number", "1", "fraction of the page that is bare paper", LIGHT),
    "white_balance": Key("table|text", "", "colour of the light: keep, paper or a profile", "restore/pipeline.py"),
    "setting": Key("text", "", "the white balance that was set", "restore/pipeline.py"),
    "balanced": Key("flag", "", "whether bare paper was made neutral", "restore/shading/white.py"),
    "paper": Key("[number]", "sRGB codes", "colour of bare paper before", "restore/shading/white.py"),
    "gains": Key("[number]", "1", "factors of red, green and blue", "restore/shading/white.py"),
    "icc_profile": Key("text", "", "name of the ICC profile", "station/images/conversion.py"),
    # Provenance of a scan
    "source": Key("table", "", "provenance of the scan", "restore/pipeline.py"),
    "provenance": Key("table", "", "provenance of the scan, as captured", "station/capture_loop/loop.py"),
    "device": Key("text", "", "scanner or method of the scan", CAMERA),
    "profile": Key("text", "", "name of the command profile", CAMERA),
    "body": Key("text", "", "serial number of the scanner", CAMERA),
    "lens": Key("text", "", "TELE, MIDDLE or WIDE", CAMERA),
    "lens_serial": Key("text", "", "serial number of the lens", CAMERA),
    "calibration": Key("table", "", "calibration that points were computed with", CAMERA),
    "mode": Key("text", "", "fast or fine", CAMERA),
    "distance_mm": Key("number", "mm", "focus distance from the lens", CAMERA),
    "distances_mm": Key("[number]", "mm", "focus distances of a capture in several depths", CAMERA),
    "laser_power": Key("number", "1 to 255", "laser power", CAMERA),
    "gain": Key("number", "0 to 7", "gain of the sensor", CAMERA),
    "average": Key("number", "", "captures that are averaged", CAMERA),
    "integrity": Key("text", "", "checksum, read_twice or read_once", CAMERA),
    "unchecked": Key("[text]", "", "checks that the command profile does not allow", CAMERA),
    "time": Key("text", "ISO 8601, UTC", "when it was made", CAMERA),
    "super_resolution": Key("table", "", "how captures were combined", "restore/texture/super_resolution.py"),
    "captures": Key(
        "number|[number]|text",
        "",
        "captures that were combined; of a rule the events of its scans, or all",
        "restore/texture/super_resolution.py",
    ),
    "factor": Key("number", "1", "pixels per source pixel along a side", "restore/texture/super_resolution.py"),
    "shifts_px": Key("[list]", "pixels", "shift of each capture", "restore/texture/super_resolution.py"),
    "turntable": Key("table", "", "turntable: its configuration, or angle and axis of a view", CONFIG),
    "deg": Key("number", "degrees", "angle of the turntable", "station/run/turntable.py"),
    "axis": Key("table|null", "", "axis of the turntable in the frame of the scanner", CONFIG),
    "point_mm": Key("[number]", "mm", "a point on the axis", CONFIG),
    "direction": Key("[number]|text", "", "direction of the axis, or of reading: ltr, rtl", CONFIG),
    # Presets and settings
    "settings": Key("table", "", "settings of a restoration", PRESETS),
    "inpaint_mm": Key("number", "mm", "width up to which occluded places are inpainted", "restore/settings.py"),
    "outputs": Key("[text]", "", "further files that are written", PRESETS),
    "language": Key("text", "", "language of the text as a Tesseract code", PRESETS),
    "foliation": Key("text", "", "pages, folios or none", PRESETS),
    "first": Key("number", "", "number of the first page or leaf", PRESETS),
    "sides": Key("text", "", "side of the first page: left or right", PRESETS),
    "size_mm": Key("[number]", "mm", "width and height of a leaf, by hand", PRESETS),
    "overlap_mm": Key("number", "mm", "facing page that a leaf keeps", PRESETS),
    "rotate": Key(
        "text", "degrees", "rotation that is requested, or auto", "station/session/derivation/restoration.py"
    ),
    "allow_distorted": Key(
        "flag", "", "write a page whose surface is too distorted", "station/session/derivation/restoration.py"
    ),
    "unit": Key("text", "", "unit of mesh coordinates", "station/session/derivation/restoration.py"),
    "scale": Key(
        "text|null",
        "",
        "where the scale is from: card, none or width x height",
        "station/session/derivation/restoration.py",
    ),
    # Events of a session
    "number": Key("number", "", "running number of an event, or of a sheet", EVENTS),
    "page": Key("number", "", "running number of the page, 0 for the volume", EVENTS),
    "kind": Key("text", "", "of an event: session, capture, stage, decision or move; of a page: what it shows", EVENTS),
    "slot": Key("text", "", "the pointer that the event sets", EVENTS),
    "parent": Key("number|null", "", "the event that the pointer named before", EVENTS),
    "software": Key("text", "", "name and version of the program", EVENTS),
    "facts": Key("table", "", "what the event records", EVENTS),
    "inputs": Key("[table]", "", "events that a stage read", EVENTS),
    "format": Key("number", "", "format of the record", EVENTS),
    "event": Key("number", "", "number of an event that was read", EVENTS),
    "sha512": Key("text", "", "SHA-512 of its record", EVENTS),
    "parameters": Key("table", "", "all that a run depends on besides its input", STEPS),
    "result": Key("table", "", "what follows from input and parameters", STEPS),
    "by": Key("text", "", "program that captured the scan", "station/capture_loop/loop.py"),
    "to": Key("number|null", "", "event that a pointer names from now on", STEPS),
    "id": Key("text", "", "identifier of the session", "station/session/log/store.py"),
    "volume": Key("table", "", "what the session is of", "station/session/log/store.py"),
    "title": Key("text", "", "title of the volume", VOLUME),
    "project": Key("text", "", "collection or order", VOLUME),
    "organisation": Key("text", "", "institution that holds the volume", VOLUME),
    "scope": Key("table", "", "pages of a rule", "station/session/terms/rules.py"),
    "future": Key("flag", "", "whether a rule is also on later pages", "station/session/terms/rules.py"),
    "side": Key("text", "", "side of a leaf, or of the parts of a rule", "station/session/terms/rules.py"),
    "style": Key("text", "", "style of a run of labels", "station/session/terms/labels.py"),
    "prefix": Key("text", "", "before each number of a run", "station/session/terms/labels.py"),
    "suffix": Key("text", "", "after each number of a run", "station/session/terms/labels.py"),
    "bracket": Key("flag", "", "whether the numbers of a run are inferred", "station/session/terms/labels.py"),
    "counted": Key("flag", "", "whether the leaves of a run have labels", "station/session/terms/labels.py"),
    "preset": Key("text", "", "name of the preset", VOLUME),
    "preset_values": Key("table", "", "the preset as it was at the beginning", VOLUME),
    "station": Key("text", "", "configuration of the station", VOLUME),
    # Photographs
    "photos": Key("[table]", "", "photographs that the page is textured from", "restore/pipeline.py"),
    "accepted": Key("flag", "", "whether a photograph is used", PHOTO),
    "size_px": Key("[number]", "pixels", "width and height of a photograph", PHOTO),
    "residual_px": Key("number", "pixels", "rms of the registration", PHOTO),
    "uncertainty_px": Key("number", "pixels", "standard deviation of the registration", PHOTO),
    "match_fraction": Key("number", "1", "fraction of printed places that match", PHOTO),
    "shown_fraction": Key("number", "1", "fraction of the page in a photograph", PHOTO),
    "camera": Key("table", "", "camera of a photograph", PHOTO),
    "obstructed_fraction": Key("number", "1", "fraction of the page obstructed in a photograph", PHOTO),
    "obstructed_mm2": Key("number", "mm²", "area obstructed in a photograph", PHOTO),
    "textured_fraction": Key("number", "1", "fraction of the page textured from a photograph", PHOTO),
    "photogrammetry": Key("table", "", "a page from photographs alone", "station/run/photos.py"),
    "photographs_used": Key("[text]", "", "names of the photographs that were joined", GRAMMETRY),
    "scale_source": Key("table", "", "where the scale comes from", GRAMMETRY),
    "from": Key("text", "", "card, page or none", "restore/photogrammetry/model.py"),
    "markers": Key("number", "", "markers of the card that were found", "restore/photogrammetry/model.py"),
    "residual_mm": Key("number|null", "mm", "deviation of a registration", "restore/photogrammetry/model.py"),
    "surface_points": Key("number", "", "measured points of the surface", GRAMMETRY),
    "edge_measured_fraction": Key("number", "1", "fraction of the page's edge that is measured", GRAMMETRY),
    "paper_outside_fraction": Key("number", "1", "fraction of the paper beyond the page", GRAMMETRY),
    "surface_residual_mm": Key("number", "mm", "distance that one point in ten exceeds", GRAMMETRY),
    "excess_area_fraction": Key("number|null", "1", "area that paper cannot have", GRAMMETRY),
    "gutter_width_range_mm": Key("number|null", "mm", "of the strip across a spine, from row to row", GRAMMETRY),
    "shape": Key("text", "", "smooth, pieces or facets", SURFACE),
    "stiffness_mm4": Key("number|null", "mm⁴", "stiffness of the smooth surface", SURFACE),
    "smooth_pieces": Key("number|null", "", "smooth pieces between creases", SURFACE),
    "adjustments": Key("[table]", "", "bundle adjustments: patches, points, residual", GRAMMETRY),
    "patches": Key("number", "", "patches that were tracked", ADJUST),
    "reprojection_px": Key("number", "pixels", "rms of a bundle adjustment", ADJUST),
    # Configuration
    "scanner": Key("table", "", "settings of the driver that `driver` names", CONFIG),
    "capture": Key("table", "", "settings of a capture", CONFIG),
    "restore": Key("table", "", "settings of a restoration", CONFIG),
    "output": Key("table", "", "names of written files", CONFIG),
    "stem": Key("text", "", "first part of the names of files", CONFIG),
    "model": Key("text", "", "model of the turntable controller", CONFIG),
    "port": Key("text", "", "serial port of the controller", CONFIG),
    "relative": Key("flag", "", "whether the controller takes relative rotations", CONFIG),
    "arc_deg": Key("number", "degrees", "angle that the views cover", CONFIG),
    "multi_depth": Key("flag", "", "captures in several depths", "drivers/vivid900/settings.py"),
    "deadline_s": Key("number|null", "s", "time limit of a capture", "drivers/scanner.py"),
}

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
