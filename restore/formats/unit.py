"""Units of length of mesh files: most formats name none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.source import MAX_COORDINATE_MM
from restore.scan import SurfaceMesh

UNIT_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
AUTO = "auto"
STANDARD = {".glb": "m"}  # glTF 2.0, section 3.4 "Coordinate System and Units"
UNSTATED = "mm"  # what scanners' software writes into formats that have no unit
GIVEN, BY_FORMAT, ASSUMED = "given", "format", "assumed"


def check_unit(unit: str) -> None:
    """Raise BadInput for a unit that is none of UNIT_MM and not AUTO."""
    if unit != AUTO and unit not in UNIT_MM:
        raise BadInput(f"{unit!r} is no unit", f"use one of: {', '.join([*UNIT_MM, AUTO])}")


def in_millimetres(path: Path, mesh: SurfaceMesh, unit: str = AUTO) -> SurfaceMesh:
    """The mesh of a file in mm; its provenance names the unit where it was given or is that of the format.

    AUTO takes the unit of the format. Many programs write millimetres into formats of metres: where a coordinate would
    lie beyond MAX_COORDINATE_MM, they are read as such, with a warning. Raises BadInput for a given unit under which a
    coordinate lies beyond that.
    """
    check_unit(unit)
    largest = float(np.abs(mesh.vertices).max(initial=0.0))
    source, warnings = GIVEN, []
    if unit == AUTO:
        standard = STANDARD.get(path.suffix.lower())
        unit, source = (standard, BY_FORMAT) if standard else (UNSTATED, ASSUMED)
        if largest * UNIT_MM[unit] > MAX_COORDINATE_MM:
            warnings = [f"the coordinates are too large for {unit}, the unit of the format: read as {UNSTATED}"]
            unit, source = UNSTATED, ASSUMED
    if largest * UNIT_MM[unit] > MAX_COORDINATE_MM:
        raise BadInput(f"{path}: a vertex lies {largest:g} {unit} from the origin", "give the file's unit with --unit")
    if source == ASSUMED and not warnings:
        return mesh
    provenance = {**mesh.provenance, "unit": unit, "unit_source": source}
    if warnings:
        provenance["warnings"] = [*mesh.provenance.get("warnings", ()), *warnings]
    return replace(mesh, vertices=mesh.vertices * UNIT_MM[unit], provenance=provenance)
