"""The side door for pictures of meshes."""

from __future__ import annotations

import numpy as np

from restore import SurfaceMesh, drawing, flatten


def test_what_draws_a_flat_page_comes_through_one_door():
    """A square of two faces: flat, unstrained, facing the viewer, and half of a picture."""
    corners = np.array([[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [8.0, 8.0, 0.0], [0.0, 8.0, 0.0]])
    page = flatten(SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])))
    np.testing.assert_allclose(drawing.average_at_vertices(page.face_strain, page.faces, 4), 0.0, atol=1e-6)
    normals = drawing.vertex_normals(page.vertices, page.faces)
    np.testing.assert_allclose(normals, np.tile([0.0, 0.0, 1.0], (4, 1)))
    seen = drawing.rasterise(corners[:, :2], page.faces, np.ones((4, 1)), 9, 18)
    assert np.isfinite(seen[..., 0]).sum() == 9 * 9
