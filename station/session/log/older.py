"""Records of format 1 under today's names.

They are of programs before the public names were settled. A record keeps its line as it was written, and with it its
digest; only its facts are read under other names. No earlier name has another meaning today, so that a value is never
mistaken for another one.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from restore.formats import current_provenance

OLDER_FORMAT = 1

Tree = Mapping[str, Any]
"""Earlier key → today's, or a pair of today's key and the tree of its value.

The elements of a list have one tree.
"""

MEASURES: Tree = {
    "covered_share": "measured_fraction",
    "cut_share": "cropped_fraction",
    "depth_share": "depth_window_fraction",
    "strain_rms": "smooth_strain_rms",
    "effective_ppi": "sampling_ppi",
    "clipped_share": "clipped_fraction",
}
RESOLUTION: Tree = {"effective_ppi": "resolved_ppi", "effective_ppi_unknown": "resolved_ppi_unknown"}
PHOTO: Tree = {
    **RESOLUTION,
    "alike": "match_fraction",
    "coverage": "shown_fraction",
    "size": "size_px",
    "covered_share": "obstructed_fraction",
    "covered_mm2": "obstructed_mm2",
    "painted_share": "textured_fraction",
}
PHOTOGRAMMETRY: Tree = {
    "views": "photographs_used",
    "left_out": "rejected",
    "scale": "scale_source",
    "points": "surface_points",
    "edge_measured": "edge_measured_fraction",
    "uncovered_paper": "paper_outside_fraction",
    "interpolated": "interpolated_fraction",
    "surface_off_mm": "surface_residual_mm",
    "stretch": "excess_area_fraction",
    "pieces": "smooth_pieces",
    "rounds": ("adjustments", {"points": "surface_points"}),
}
COVERAGE: Tree = {
    "filled": "interpolated",
    "hidden": "occluded",
    "invented": "inpainted",
    "covered": "obstructed",
    "cut": "cropped_fraction",
}
CHORDS: Tree = {"estimated_share": "estimated_fraction", "farthest_at_mm": "max_difference_at_mm"}
LIGHT: Tree = {
    "paper_share": "paper_fraction",
    "regions_share": "regions_fraction",
    "gain": "illumination_gain",
}
REPORT: Tree = {
    **RESOLUTION,
    "steps": "iterations",
    "decimation": "decimation_error_mm",
    "turned_deg": "rotation_deg",
    "filled_share": "interpolated_fraction",
    "shots": "extra_scans",
    "strain": ("strain", {"against_chords": ("chord_strain", CHORDS)}),
    "coverage": ("coverage", COVERAGE),
    "light": ("light", LIGHT),
    "white": ("white_balance", {**LIGHT, "mode": "setting", "profile": "icc_profile"}),
    "photos": ("photos", PHOTO),
    "photogrammetry": ("photogrammetry", PHOTOGRAMMETRY),
    "measures": ("measures", MEASURES),
}
SETTINGS: Tree = {"white": "white_balance", "fill_hidden_mm": "inpaint_mm"}
PRESET: Tree = {"settings": ("settings", SETTINGS), "thresholds": ("thresholds", MEASURES)}
PARAMETERS: Tree = {**PRESET, "turn": "rotate", "anyway": "allow_distorted"}
FACTS: Tree = {
    "volume": ("volume", {"settings": ("preset_values", PRESET)}),
    "parameters": ("parameters", PARAMETERS),
    "value": ("value", PRESET),
    "result": ("result", REPORT),
}


def current_facts(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts of a record of format 1 under today's names.

    >>> current_facts({"result": {"steps": 9, "measures": {"effective_ppi": 40.0}, "effective_ppi": 31.0}})
    {'result': {'iterations': 9, 'measures': {'sampling_ppi': 40.0}, 'resolved_ppi': 31.0}}
    """
    table: dict[str, Any] = _renamed(facts, FACTS)
    if "source" in table:  # of a capture
        table["scan"] = table.pop("source")
    if isinstance(provenance := table.get("provenance"), Mapping):
        table["provenance"] = _capture_provenance(provenance)
    if isinstance(result := table.get("result"), dict):
        if isinstance(source := result.get("source"), Mapping):
            result["source"] = current_provenance(source)
        if "level" in result and isinstance(checks := result.pop("findings", None), list):  # of a verdict
            result["checks"] = [_check(one) for one in checks]
    return table


def _renamed(value: Any, tree: Tree) -> Any:
    if isinstance(value, list):
        return [_renamed(one, tree) for one in value]
    if not isinstance(value, Mapping):
        return value
    table = {}
    for key, item in value.items():
        target = tree.get(key, key)
        name, below = (target, {}) if isinstance(target, str) else target
        table[name] = _renamed(item, below) if below else item
    return table


def _capture_provenance(provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Return the provenance of a capture.

    That of photographs listed the sizes of its images as `pictures`.
    """
    sizes = {"image_sizes_px": provenance["pictures"]} if provenance.get("device") == "photographs" else {}
    kept = {key: value for key, value in provenance.items() if not (sizes and key == "pictures")}
    return current_provenance({**kept, **sizes})


def _check(check: Any) -> Any:
    """Return a check of a verdict with the name that its measure has today."""
    if not isinstance(check, Mapping) or "name" not in check:
        return check
    return {**check, "name": MEASURES.get(str(check["name"]), check["name"])}
