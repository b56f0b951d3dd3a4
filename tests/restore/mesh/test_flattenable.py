"""One-sided surfaces and closed bands are refused; a sheet, one with a hole and a roll that is open are not."""

import numpy as np
import pytest

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
