"""A prepared cylinder unrolled: flat positions against arc lengths, stages in order, and the page turned upright."""

from contextlib import contextmanager

import numpy as np
import pytest

from oracles.markers import rigid_residual
from restore.page import FlatMesh
from restore.prepared.facet_sheet import decimate_sheet, unroll
from restore.prepared.prepare import prepare
from restore.prepared.prepared import square_to_picture
from restore.settings import Settings

RADIUS_MM = 60.0
# A path over a cylinder runs on tangents of half a sample either side (test_sheet.py): 1.2e-5 of 90 mm; what the
# relaxation to convergence leaves is of the same size.
ARC_MM = 0.02
FEWER = 0.1  # of the points asked for: the decimation stops near the number


@pytest.fixture(scope="module")
def sheet(camera):
    bent = np.full(camera.shape, np.nan)
    bent[20:140, 30:170] = camera.cylinder(RADIUS_MM)[20:140, 30:170]
    return prepare(camera.shot(bent)).sheet


@pytest.fixture(scope="module")
def stages():
    return []


@pytest.fixture(scope="module")
def unrolled(sheet, stages):
    @contextmanager
    def clock(stage):
        stages.append(stage)
        yield

    return unroll(sheet, Settings(points=500), clock)


def arcs(points):
    """(n, 2) mm: the cylinder's exact development, arc length and height."""
    axis = -921.5 - RADIUS_MM
    return np.stack([RADIUS_MM * np.arctan2(points[:, 0], points[:, 2] - axis), points[:, 1]], axis=1)


@pytest.mark.parametrize("mesh", ["coarse", "fine"])
def test_both_meshes_lie_where_the_arc_lengths_put_them(unrolled, mesh):
    found = getattr(unrolled, mesh)
    residual, scale = rigid_residual(found.flat, arcs(found.vertices))
    assert np.sqrt((residual**2).sum(axis=1).mean()) < ARC_MM
    assert scale == pytest.approx(1.0, abs=ARC_MM / 90)


def test_the_stages_are_timed_in_their_order(unrolled, stages):
    assert stages == ["decimate", "flatten", "refine"]


def test_nodes_are_the_grid_positions_of_the_fine_mesh(sheet, unrolled):
    np.testing.assert_allclose(sheet.points(unrolled.nodes), unrolled.fine.vertices, atol=1e-9)


def test_the_coarse_mesh_has_about_as_many_points_as_asked_for(sheet, unrolled):
    assert len(unrolled.coarse.vertices) == pytest.approx(500, rel=FEWER)
    mesh, nodes = decimate_sheet(sheet, 200)
    assert len(mesh.vertices) == len(nodes) == pytest.approx(200, rel=FEWER)


def test_the_distance_of_the_coarse_mesh_is_that_of_its_chords(unrolled):
    assert 0 < unrolled.distance["mean_mm"] < unrolled.distance["max_mm"] < 1.0


@pytest.mark.parametrize("degrees", [-20.0, 3.0, 30.0])
def test_a_rectangle_is_turned_square_about_its_middle(degrees):
    across, along = np.meshgrid(np.linspace(-70, 70, 15), np.linspace(-50, 50, 11))
    truth = np.stack([across.ravel(), along.ravel()], axis=1)
    number = np.arange(15 * 11).reshape(11, 15)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turned = truth @ [[cos, sin], [-sin, cos]]
    page = square_to_picture(FlatMesh(np.column_stack([truth, 0 * truth[:, 0]]), faces, flat=turned))
    np.testing.assert_allclose(page.flat, truth, atol=1e-9)
