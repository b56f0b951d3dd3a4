"""A picture for a mesh with vertex colours and no texture coordinates.

Most scanners and photogrammetry write those. The surface is flattened once and its colours are drawn there,
interpolated over the faces. The vertices are what the picture resolves, whatever its pixels: they are a little finer,
so that texturing the page from it does not blur it.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np

from restore.errors import RestoreError
from restore.findings import Finding
from restore.flattening.methods import flatten_points
from restore.formats.cleaning.seams import OVERSAMPLING
from restore.formats.parsing.mesh import PaintedMesh
from restore.mesh.measures import face_normals, signed_areas
from restore.mesh.places import first_at_place
from restore.mesh.pose import pose_on_table
from restore.mesh.triangulate import compact
from restore.mesh.validate import ValidMesh, validated
from restore.numerics.robust import NEARLY_ALL
from restore.range_image.resample import resample
from restore.scan import Bytes, Floats, Ints, SurfaceMesh, with_findings
from restore.texture.page import MM_PER_INCH, median_over_area, nearest_colours, page_map

MAX_PIXELS = 16_000_000  # ten times the vertices of the largest range camera


def with_picture(mesh: PaintedMesh, colours: Bytes) -> SurfaceMesh:
    """Return the mesh with a picture of its vertex colours.

    It has one vertex for each place. Where its surface cannot be flattened, the mesh without colours, with a finding.
    colours: (n, 3).
    """
    bare = SurfaceMesh(mesh.vertices, mesh.faces, provenance=mesh.provenance, findings=mesh.findings)
    place = first_at_place(mesh.vertices)
    used, faces = compact(np.arange(len(mesh.vertices)), place[mesh.faces])
    number = np.zeros(len(mesh.vertices), np.int64)
    number[used] = np.arange(len(used))
    try:
        joined = validated(replace(bare, vertices=mesh.vertices[used], faces=faces))
        return _painted(joined, bare, _means(colours, number[place], len(used)))
    except RestoreError as error:
        return with_findings(bare, Finding.of("colours_left_out", reason=error))


def _means(colours: Bytes, number: Ints, count: int) -> Floats:
    """Return the mean colours (count, 3) of the vertices of each number (n,)."""
    fraction = 1.0 / np.maximum(np.bincount(number, minlength=count), 1)
    return np.stack([np.bincount(number, channel, count) * fraction for channel in colours.T], axis=1)


def _painted(mesh: ValidMesh, source: SurfaceMesh, colours: Floats) -> SurfaceMesh:
    """Return a mesh with a picture of the colours of its vertices.

    It has the provenance and findings of its source.
    colours: (n, 3).
    """
    flat = _in_one_view(mesh)
    areas = np.abs(signed_areas(flat, mesh.faces))
    ppi = _picture_ppi(flat, areas)
    painted = page_map(flat, mesh.faces, colours, ppi)
    known = np.isfinite(painted[..., 0])
    picture = nearest_colours(np.nan_to_num(painted + 0.5).astype(np.uint8), known)
    corner = np.array([flat[:, 0].min(), flat[:, 1].max()])
    texcoords = (flat - corner) * (np.array([1.0, -1.0]) * ppi / MM_PER_INCH) - 0.5  # as in page_map
    surface = np.linalg.norm(face_normals(mesh.vertices, mesh.faces), axis=1)
    finer = median_over_area(_apart(areas), surface) * ppi / MM_PER_INCH
    provenance = {**source.provenance, "texture_source": "colours of vertices", "oversampling": finer}
    return SurfaceMesh(mesh.vertices, mesh.faces, texcoords, picture, provenance, findings=source.findings)


def _in_one_view(mesh: ValidMesh) -> Floats:
    """Return the vertices (n, 2) mm as one view shows them, y up.

    By angles where no view shows all, or few have to be flattened.
    """
    if resample(mesh) is not None:
        return pose_on_table(mesh.vertices, mesh.faces).positions[:, :2]
    return flatten_points(mesh, "conformal").flat


def _picture_ppi(flat: Floats, areas: Floats) -> float:
    """Return the pixels per inch of a picture for vertices.

    flat: (n, 2) mm, between faces of areas (m,) mm².
    """
    densest = median_over_area(-_apart(areas), areas, fraction=NEARLY_ALL)
    most = sqrt(MAX_PIXELS / float(np.prod(np.ptp(flat, axis=0))))
    return MM_PER_INCH * min(OVERSAMPLING / -densest, most)


def _apart(areas: Floats) -> Floats:
    """Return the distance (m,) mm between the vertices round faces.

    Their areas are (m,) mm²: there are two faces to a vertex.
    """
    return np.sqrt(2.0 * areas)
