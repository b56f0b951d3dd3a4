"""One-sided surfaces and closed bands are refused; a sheet, one with a hole and a roll that is open are not."""

import numpy as np
import pytest

from restore import flatten
from restore.errors import BadInput
from restore.flattening.methods import flatten_points
from restore.mesh.flattenable import refuse_unflattenable
from restore.mesh.topology import Topology
from restore.scan import SurfaceMesh

AROUND, ACROSS = 40, 5


def strip(*, closed=True, twisted=False):
    """A band of radius 60 mm, 20 mm wide, closed or open, twisted by half a turn or not."""
    turns, widths = np.linspace(0, 2 * np.pi, AROUND, endpoint=False), np.linspace(-10, 10, ACROSS)
    t, w = np.meshgrid(turns, widths, indexing="ij")
    lean = t / 2 if twisted else np.full_like(t, np.pi / 2)
    radius = 60 + w * np.cos(lean)
    vertices = np.stack([radius * np.cos(t), w * np.sin(lean), radius * np.sin(t)], axis=-1).reshape(-1, 3)
    rows = np.arange(AROUND * ACROSS).reshape(AROUND, ACROSS)
    last = rows[0][::-1] if twisted else rows[0]
    here, there = (rows, np.vstack([rows[1:], last])) if closed else (rows[:-1], rows[1:])
    corners = here[:, :-1], there[:, :-1], there[:, 1:], here[:, 1:]
    halves = np.stack([corners[0], corners[1], corners[2]], -1), np.stack([corners[0], corners[2], corners[3]], -1)
    return vertices, np.concatenate([half.reshape(-1, 3) for half in halves])


@pytest.mark.parametrize(("twisted", "message"), [(True, "one side"), (False, "band")])
def test_a_moebius_strip_and_a_closed_band_are_refused(twisted, message):
    with pytest.raises(BadInput, match=message) as caught:
        flatten_points(SurfaceMesh(*strip(twisted=twisted)))
    assert "cut" in caught.value.hint


def test_an_open_roll_is_a_page():
    vertices, faces = strip(closed=False)
    refuse_unflattenable(vertices, Topology(faces))
    assert np.isfinite(flatten_points(SurfaceMesh(vertices, faces)).flat).all()


def test_a_bent_sheet_with_a_hole_is_a_page(warped):
    page = warped("curl", count=800)
    kept = np.linalg.norm(page.flat[page.mesh.faces].mean(axis=1), axis=1) > 40
    faces = page.mesh.faces[kept]
    refuse_unflattenable(page.mesh.vertices, Topology(faces))


@pytest.mark.parametrize(("width", "curl"), [(0.001, 0.0), (0.001, 100.0), (0.02, 100.0)])
def test_a_strip_without_a_width_is_refused(width, curl):
    """Its lengths do not determine its form: it would come out as an arc, millimetres high."""
    with pytest.raises(BadInput, match="too narrow"):
        flatten(SurfaceMesh(*ribbon(300.0, width, curl)))


def test_a_narrow_strip_keeps_its_length_and_its_width():
    page = flatten(SurfaceMesh(*ribbon(300.0, 0.1, 100.0)))
    assert np.ptp(page.flat, axis=0) == pytest.approx([300.0, 0.1], abs=0.01)


def test_a_piece_without_a_width_does_not_keep_the_page_from_being_flattened():
    (vertices, faces), (narrow, own) = ribbon(300.0, 20.0, 100.0), ribbon(300.0, 0.001, 0.0)
    page = flatten(
        SurfaceMesh(np.vstack([vertices, narrow + [0, 40, 0]]), np.concatenate([faces, own + len(vertices)]))
    )
    assert np.ptp(page.flat[: len(vertices)], axis=0) == pytest.approx([300.0, 20.0], abs=0.1)


def ribbon(length, width, curl, count=200):
    """A strip of a length and a width in mm, bent along it to a cylinder of radius `curl`, or flat where that is 0."""
    along = np.linspace(0.0, length, count)
    x, z = (curl * np.sin(along / curl), curl * (1 - np.cos(along / curl))) if curl else (along, 0.0 * along)
    vertices = np.concatenate([np.stack([x, np.full(count, y), z], axis=1) for y in (0.0, width)])
    number = np.arange(2 * count).reshape(2, count)
    a, b, c, d = number[0, :-1], number[0, 1:], number[1, 1:], number[1, :-1]
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
