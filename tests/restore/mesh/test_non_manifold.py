"""Fins are cut off a sheet, leaves off a page, and what cannot be told is said."""

import numpy as np
import pytest

from restore.mesh.non_manifold import without_fins
from restore.mesh.validate import validated
from restore.scan import SurfaceMesh

COLS, ROWS, STEP_MM = 12, 8, 5.0


def grid(number):
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    return np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))])


def page():
    across, up = np.meshgrid(np.arange(COLS) * STEP_MM, np.arange(ROWS) * STEP_MM)
    vertices = np.stack([across, up, 3.0 * np.sin(across / 15.0)], axis=-1).reshape(-1, 3)
    return vertices, np.arange(ROWS * COLS).reshape(ROWS, COLS)


def with_strip(foot, top):
    """The page with a strip from the vertices of a row, foot (k,), to another (k,) or to new ones over it."""
    vertices, number = page()
    if top is None:
        top = len(vertices) + np.arange(len(foot))
        vertices = np.vstack([vertices, vertices[foot] + [0.0, 1.0, 6.0]])
    return validated(SurfaceMesh(vertices, np.concatenate([grid(number), grid(np.stack([foot, top]))])))


def test_a_fin_is_cut_off_and_said():
    vertices, number = page()
    mesh, findings = without_fins(with_strip(number[3, 2:9], None))
    assert len(mesh.faces) == len(grid(number))
    assert len(mesh.vertices) == len(vertices)
    (said,) = (one.text for one in findings)
    assert "are removed" in said


def test_the_largest_of_the_leaves_at_a_spine_is_the_page():
    vertices, number = page()
    spine = number[:, 0]
    left = len(vertices) + np.arange(ROWS * 3).reshape(ROWS, 3)
    leaf = [vertices[spine, None] + np.arange(1, 4)[:, None] * way for way in ([-STEP_MM, 0, 1.0], [-2.0, 0, STEP_MM])]
    whole = np.vstack([vertices, *(part.reshape(-1, 3) for part in leaf)])
    leaves = [grid(np.column_stack([number[:, 0], left + k * ROWS * 3])[:, ::-1]) for k in range(2)]
    mesh, findings = without_fins(validated(SurfaceMesh(whole, np.concatenate([grid(number), *leaves]))))
    assert len(mesh.faces) == len(grid(number)) + len(leaves[0])  # the page goes on to the left smoothly
    assert np.ptp(mesh.vertices[:, 2]) < 2 * STEP_MM
    assert len(findings) == 1


def test_a_strip_that_is_joined_at_both_its_sides_is_said_to_be_left():
    _, number = page()
    mesh, findings = without_fins(with_strip(number[2, 3:7], number[5, 3:7]))
    assert any(one.code == "edges_unclear" for one in findings) == ((mesh.topology.face_counts > 2).any())


@pytest.mark.parametrize("turned", [False, True])
def test_a_plain_mesh_stays_as_it_is(turned):
    vertices, number = page()
    mesh = validated(SurfaceMesh(vertices, grid(number)[:, :: -1 if turned else 1]))
    assert without_fins(mesh) == (mesh, [])
