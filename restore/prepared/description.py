"""Describes the flat mesh of a page for its report, and what is to be reported of it."""

from __future__ import annotations

import numpy as np

from restore.findings import NOTABLE, Finding
from restore.mesh.measures import edge_strain, straight_lengths
from restore.mesh.strain import smooth_rms_strain
from restore.mesh.topology import Topology
from restore.numerics.limits import SINGLE_PRECISION, sum_in_order
from restore.numerics.robust import MAJORITY
from restore.outline.rectangle import page_size
from restore.page import FlatMesh
from restore.prepared.prepared import Prepared, Unrolled
from restore.report import ChordStrainReport, FaceStrainReport, MeshReport, StrainReport
from restore.scan import Ints
from restore.settings import Settings
from restore.texture.page import Painting

NOT_DEVELOPABLE = 0.005  # rms of the smooth strain: paper stretches by less before it tears
ESTIMATED = 0.01  # of its straight length: an edge whose rest length differs by more bends much


def describe(prepared: Prepared, unrolled: Unrolled, painting: Painting, settings: Settings) -> MeshReport:
    """Describe a page: its mesh, the strain of its flattening, what its source resolves."""
    fine = unrolled.fine
    width, height = page_size(fine.flat[fine.topology.border])
    return {
        "points": len(unrolled.coarse.vertices),
        "method": settings.method,
        "dpi": settings.dpi,
        "shading": settings.shading,
        "iterations": unrolled.coarse.iterations,
        "flipped_faces": fine.flipped,
        "area_ratio": float(np.abs(fine.areas).sum()) / sum_in_order(fine.surface_areas),
        "folded_faces": int((fine.signs < 0.0).sum()),
        "convergence": fine.convergence,
        "strain": _strain(fine),
        "page_mm": [width, height],
        **painting.resolution.described(),
        "decimation_error_mm": unrolled.distance,
        **prepared.facts,
    }


def _strain(mesh: FlatMesh) -> StrainReport:
    return {
        "rms": float(np.sqrt(np.mean(mesh.strain**2))),
        "smooth_rms": smooth_rms_strain(mesh.flat, mesh.edges, mesh.lengths),
        "max": float(np.abs(mesh.strain).max()),
        "faces": _face_strain(mesh),
        "chord_strain": _chord_strain(mesh),
    }


def _face_strain(mesh: FlatMesh) -> FaceStrainReport:
    """Return area-weighted mean and rms of the faces, and the greatest absolute value."""
    area = np.abs(mesh.areas)
    weight = area / area.sum()
    stretch, shear = (
        {
            "mean": float((weight * values).sum()),  # not @: a library's threads wait longer than this takes
            "rms": float(np.sqrt((weight * values**2).sum())),
            "max": float(np.abs(values).max()),
        }
        for values in mesh.face_strain.T
    )
    return {"stretch": stretch, "shear": shear}


def _chord_strain(mesh: FlatMesh) -> ChordStrainReport:
    """Return the strain against the straight lengths of the edges.

    And how far the rest lengths differ from those, and where.
    """
    chords = straight_lengths(mesh.vertices, mesh.edges)
    chords = np.maximum(chords, SINGLE_PRECISION * chords.mean())
    strain, estimated = edge_strain(mesh.flat, mesh.edges, chords), mesh.lengths / chords - 1.0
    farthest = mesh.edges[np.argmax(np.abs(mesh.lengths - chords))]
    return {
        "rms": float(np.sqrt(np.mean(strain**2))),
        "max": float(np.abs(strain).max()),
        "estimate_rms": float(np.sqrt(np.mean(estimated**2))),
        "estimated_fraction": float((np.abs(estimated) > ESTIMATED).mean()),
        "max_difference_at_mm": mesh.flat[farthest].mean(axis=0).tolist(),
    }


def connected_pieces(faces: Ints) -> int:
    """The number of connected pieces of faces (m, 3)."""
    return len(np.unique(Topology(faces).pieces))


def findings_of_page(fine: FlatMesh, strain: StrainReport) -> list[Finding]:
    """What is to be reported of a flat page with its strain."""
    found = list(fine.findings)
    if fine.texture is None or fine.texcoords is None:
        found.append(Finding.of("no_colour"))
    count = connected_pieces(fine.faces)
    if count > 1:
        found.append(Finding.of("pieces", count=count))
    upside_down = fine.flipped / len(fine.faces)
    if upside_down > NOTABLE:
        found.append(Finding.of("upside_down", upside_down))
    if strain["smooth_rms"] > NOT_DEVELOPABLE:
        found.append(Finding.of("not_developable", strain=strain["smooth_rms"]))
    estimated = strain["chord_strain"]["estimated_fraction"]
    if estimated > MAJORITY:  # those of fewer are checked by those that need no estimate
        found.append(Finding.of("lengths_estimated", estimated))
    return found
