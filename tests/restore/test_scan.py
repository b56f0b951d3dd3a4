"""The data types: what counts as measured, and that a flat mesh keeps all of its surface mesh."""

from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest

from restore.page import FlatMesh
from restore.scan import RangeScan, SurfaceMesh


def test_a_sample_is_measured_only_when_all_three_coordinates_are_finite():
    points = np.zeros((2, 3, 3))
    points[0, 1, 2] = np.nan
    points[1, 0] = np.inf
    scan = RangeScan(points, None, np.zeros((2, 3, 2)))
    np.testing.assert_array_equal(scan.measured, [[True, False, True], [False, True, True]])


def test_a_flat_mesh_has_every_field_of_its_surface_mesh():
    texture, provenance = np.zeros((4, 4, 3), np.uint8), {"lens": "MIDDLE"}
    mesh = SurfaceMesh(np.eye(3), np.array([[0, 1, 2]]), np.zeros((3, 2)), texture, provenance)
    flat, lengths = np.zeros((3, 2)), np.ones(3)
    page = FlatMesh.of(mesh, flat, lengths, 7)
    for field in fields(SurfaceMesh):
        assert getattr(page, field.name) is getattr(mesh, field.name), field.name
    assert (page.flat is flat, page.lengths is lengths, page.iterations) == (True, True, 7)


def test_scans_and_meshes_cannot_be_reassigned():
    scan = RangeScan(np.zeros((1, 1, 3)), None, np.zeros((1, 1, 2)))
    with pytest.raises(FrozenInstanceError):
        scan.points = np.ones((1, 1, 3))
