"""A page as a mesh, and one that is interpolated between measured points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from restore.page import FlatMesh
from restore.pipeline import Stopwatch
from restore.prepared.plain_mesh import InterpolatedPage, PlainMesh
from restore.scan import InterpolatedMesh
from restore.settings import Settings
from restore.texture.coverage import Coverage, CoverageClass
from restore.texture.page import MM_PER_INCH

DPI = 127.0


def curved(count: int) -> FlatMesh:
    """A square of 80 mm with a bend, from a grid of count × count points."""
    side = np.linspace(0.0, 80.0, count)
    flat = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    bent = np.column_stack([60.0 * np.sin(flat[:, 0] / 60.0), flat[:, 1], 60.0 * np.cos(flat[:, 0] / 60.0)])
    place = np.arange(count**2).reshape(count, count)
    a, b, c, d = (part.ravel() for part in (place[:-1, :-1], place[:-1, 1:], place[1:, :-1], place[1:, 1:]))
    return FlatMesh(bent, np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)]), flat=flat)


@pytest.mark.parametrize(("points", "left"), [(0, 31**2), (200, 200)])
def test_a_mesh_is_reduced_to_the_points_that_are_asked_for(points, left):
    found = PlainMesh(curved(31)).unroll(Settings(points=points), Stopwatch(None))
    assert len(found.fine.vertices) == pytest.approx(left, rel=0.05)


def test_what_lies_far_from_all_measured_points_is_filled_in():
    reach, half = 8.0, 20.0  # mm: of a measured point, and of a square without any
    page = curved(161)
    bent, flat, faces = page.vertices, page.flat, page.faces
    off = np.abs(flat - 40.0).max(axis=1)
    surface = InterpolatedMesh(bent, faces, measured=bent[off >= half], reach_mm=reach)
    shown = np.ones((400, 400), bool)
    shown[:, :10] = False
    kinds = InterpolatedPage(PlainMesh(page), surface).kinds_on(page, shown, DPI)
    rows, cols = np.nonzero(kinds == CoverageClass.INTERPOLATED)
    wide = 2 * (half - reach) * DPI / MM_PER_INCH  # chords are shorter than arcs by a twentieth of a millimetre
    assert np.ptp(rows) + 1 == pytest.approx(wide, abs=2)
    assert np.ptp(cols) + 1 == pytest.approx(wide, abs=2)
    assert len(rows) == pytest.approx(wide**2, rel=0.03)
    assert Coverage(kinds).fractions()["interpolated"] == pytest.approx(len(rows) / (400 * 390))
    assert (kinds[:, :10] == CoverageClass.OUTSIDE).all()
    nowhere = replace(surface, measured=np.empty((0, 3)))
    assert not (InterpolatedPage(PlainMesh(page), nowhere).kinds_on(page, shown, DPI) == CoverageClass.MEASURED).any()
