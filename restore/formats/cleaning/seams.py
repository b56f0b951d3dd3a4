"""One picture for a mesh whose texture is an atlas of charts.

Photogrammetry and mesh editors write atlases. At the seams between charts a place has several vertices, one for each
chart. Left so, the sheet would fall apart into the charts. It is flattened once by angles, over the places, and the
charts are drawn there next to each other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_dilation

from restore.errors import RestoreError
from restore.flattening.methods import flatten_points
from restore.mesh.adjacency import components
from restore.mesh.places import SAME_PIXELS, first_at_place
from restore.mesh.raster import rasterise
from restore.mesh.topology import Topology
from restore.mesh.triangulate import compact
from restore.mesh.validate import validated
from restore.scan import Bytes, Ints, SurfaceMesh
from restore.texture.page import MM_PER_INCH, nearest_colours, page_map, sample, sampling_ppi

OVERSAMPLING = 1.5  # of charts or vertices, so that to paint them twice does not blur them


def without_seams(mesh: SurfaceMesh) -> SurfaceMesh:
    """Return the mesh with a vertex for each place and a seamless picture.

    Unchanged where it has none, or where its places do not make a sheet that can be flattened: a tube is cut open at a
    seam.
    """
    if mesh.texture is None or mesh.texcoords is None:
        return mesh
    place = first_at_place(mesh.vertices)
    if (np.abs(mesh.texcoords - mesh.texcoords[place]) < SAME_PIXELS).all():
        return mesh
    try:
        charts = validated(mesh).faces  # turned to the side that the charts show
        used, faces = compact(np.arange(len(mesh.vertices)), place[charts])
        flat = flatten_points(SurfaceMesh(mesh.vertices[used], faces), "conformal").flat
        number = np.zeros(len(mesh.vertices), np.int64)
        number[used] = np.arange(len(used))
        of_charts = flat[number[place]]
        ppi = OVERSAMPLING * sampling_ppi(of_charts, charts, mesh.texcoords)
        picture = sample(_padded(mesh, charts), page_map(of_charts, charts, mesh.texcoords, ppi))
    except RestoreError:
        return mesh
    corner = np.array([of_charts[:, 0].min(), of_charts[:, 1].max()])
    texcoords = (flat - corner) * (np.array([1.0, -1.0]) * ppi / MM_PER_INCH) - 0.5  # as in page_map
    label = components(Topology(charts).edges, len(mesh.vertices))[charts[:, 0]]
    provenance = {**mesh.provenance, "charts": len(np.unique(label)), "oversampling": OVERSAMPLING}
    return replace(
        mesh, vertices=mesh.vertices[used], faces=faces, texcoords=texcoords, texture=picture, provenance=provenance
    )


def _padded(mesh: SurfaceMesh, charts: Ints) -> Bytes:
    """Extend the colours of an atlas beyond its charts (m, 3).

    The area between them may be black. Its own padding counts for a pixel round each chart, as the cubic kernel reads
    it.
    """
    assert mesh.texture is not None and mesh.texcoords is not None
    covered = rasterise(mesh.texcoords, charts, np.zeros((len(mesh.texcoords), 1)), *mesh.texture.shape[:2])
    return nearest_colours(mesh.texture, binary_dilation(np.isfinite(covered[..., 0]), np.ones((3, 3))))
