"""Units of length of mesh files.

Most formats name none, and those of CT volumes count voxels.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from restore.errors import BadInput
from restore.findings import Finding
from restore.numerics.units import ASSUMED, BY_FORMAT, GIVEN, MAX_COORDINATE_MM, UNIT_MM, UNSTATED
from restore.runtime.arguments import checks_types
from restore.scan import SurfaceMesh, with_findings

EDGE_MM = {**UNIT_MM, "um": 1e-3, "µm": 1e-3}
ASSUMED_VOXEL = "10um"  # between the 3 and 25 µm of the scrolls that have been scanned
MAX_UNIT_MM = 1e4
AUTO = "auto"
OwnUnit = tuple[str, str, list[Finding]]  # the unit of a file, where it comes from, and findings
Mesh = TypeVar("Mesh", bound=SurfaceMesh)
_EDGE = re.compile(r"([0-9]+(?:\.[0-9]+)?|\.[0-9]+) ?([a-zµ]+)", re.ASCII | re.IGNORECASE)
DOUBTFUL = ("unit_too_large", "voxel_assumed")  # codes of findings
# glTF 2.0, section 3.4 "Coordinate System and Units"; ASTM E2807, 8.2.1; PTX as Leica's programs write it.
STANDARD = {".glb": "m", ".gltf": "m", ".e57": "m", ".ptx": "m"}


@checks_types
def check_unit(unit: str) -> None:
    """Raise BadInput for an unknown unit.

    Known are UNIT_MM, AUTO, and an edge of a voxel such as 7.91um.
    """
    if unit != AUTO and unit_mm(unit) is None:
        raise BadInput(
            f"{unit!r} is not a unit", f"use one of: {', '.join([*UNIT_MM, AUTO])}, or the edge of a voxel, as 7.91um"
        )


def unit_mm(unit: str) -> float | None:
    """Return a unit in mm, None for another text.

    It is one of UNIT_MM, or a number and one of EDGE_MM for the edge of a voxel.

    >>> unit_mm("cm"), unit_mm("0.5mm"), unit_mm("ft")
    (10.0, 0.5, None)
    """
    if unit in UNIT_MM:
        return UNIT_MM[unit]
    found = _EDGE.fullmatch(unit)
    if found is None or found[2] not in EDGE_MM:
        return None
    edge = float(found[1]) * EDGE_MM[found[2]]
    return edge if 0.0 < edge <= MAX_UNIT_MM else None


def of_format(path: Path, _mesh: SurfaceMesh, largest: float) -> OwnUnit:
    """Return the unit of the format of a file.

    Many programs write millimetres into formats of metres: where a coordinate would lie beyond MAX_COORDINATE_MM, they
    are read as such, with a finding.
    largest: its largest coordinate.
    """
    standard = STANDARD.get(path.suffix.lower())
    if standard is None:
        return UNSTATED, ASSUMED, []
    if largest * UNIT_MM[standard] > MAX_COORDINATE_MM:
        return UNSTATED, ASSUMED, [Finding.of("unit_too_large", standard=standard, unit=UNSTATED)]
    return standard, BY_FORMAT, []


def of_voxels(_path: Path, mesh: SurfaceMesh, _largest: float) -> OwnUnit:
    """Return the voxel that the file of a segment names, or else ASSUMED_VOXEL with a finding."""
    if voxel_um := mesh.provenance.get("voxel_um"):
        return f"{voxel_um:.9f}um", BY_FORMAT, []
    return ASSUMED_VOXEL, ASSUMED, [Finding.of("voxel_assumed", voxel=ASSUMED_VOXEL)]


def in_millimetres(
    path: Path, mesh: Mesh, unit: str = AUTO, own_unit: Callable[[Path, SurfaceMesh, float], OwnUnit] = of_format
) -> Mesh:
    """Return the mesh of a file in mm.

    Its provenance names the unit where it was given or is that of the format.
    own_unit: the unit for AUTO, by path, mesh and largest coordinate.
    Raises BadInput for a given unit under which a coordinate lies beyond MAX_COORDINATE_MM.
    """
    check_unit(unit)
    largest = float(np.abs(mesh.vertices).max(initial=0.0))
    source, found = GIVEN, list[Finding]()
    if unit == AUTO:
        unit, source, found = own_unit(path, mesh, largest)
    factor = unit_mm(unit) or 1.0
    if largest * factor > MAX_COORDINATE_MM:
        raise BadInput(
            f"{path}: a vertex lies {largest:g} {unit} from the origin",
            "give the file's unit with --unit, where the command has it",
        )
    if source == ASSUMED and not found:
        return mesh
    provenance = {**mesh.provenance, "unit": unit, "unit_source": source}
    return with_findings(replace(mesh, vertices=mesh.vertices * factor, provenance=provenance), *found)


def rescale_mesh(mesh: SurfaceMesh, factor: float) -> SurfaceMesh:
    """Scale a mesh by a factor that its true size gives.

    Findings of a doubtful unit are settled by it.
    """
    findings = tuple(one for one in mesh.findings if one.code not in DOUBTFUL)
    provenance = {**mesh.provenance, "unit": UNSTATED, "unit_source": GIVEN}
    return replace(mesh, vertices=mesh.vertices * factor, provenance=provenance, findings=findings)
