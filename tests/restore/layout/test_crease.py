"""Two walls meet within a fraction of a sample, however their gutter falls between the columns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from restore import Settings
from restore.layout.crease import place_crease
from restore.layout.find import inspect
from tests.restore.layout.conftest import shot


@pytest.fixture(scope="module")
def sheet():
    return inspect(shot(False)[0], Settings(points=300)).flattened.sheet


def walls(sheet, at, *, bend=0.0, third=0.0):
    """The sheet with a valley at column `at` of its middle row, which bends by so much to its ends.

    third: of the left wall's depth, what no parabola can follow.
    """
    rows, cols = np.indices(sheet.inside.shape)
    middle = rows.shape[0] / 2
    across = cols - at - bend * ((rows - middle) / middle) ** 2
    depth = 1e-3 - 2e-6 * np.abs(across) + 1e-8 * across**2 + np.where(across < 0, third * across**3, 0.0)
    planes = np.dstack([depth, np.zeros((*depth.shape, 2))])
    everywhere = np.ones(depth.shape, bool)
    return replace(sheet, planes=planes, inside=everywhere, measured=everywhere)


@pytest.mark.parametrize("at", [100.0, 100.3, 100.5, 100.9])
@pytest.mark.parametrize("bend", [0.0, 3.0])
def test_walls_meet_where_they_cross(sheet, at, bend):
    rows = np.arange(20.0, sheet.inside.shape[0] - 20)
    crease = place_crease(walls(sheet, at, bend=bend), rows, np.full(len(rows), 101.0))
    middle = sheet.inside.shape[0] / 2
    expected = at + bend * ((crease.nodes[:, 0] - middle) / middle) ** 2
    np.testing.assert_allclose(crease.nodes[:, 1], expected, atol=0.02)
    assert crease.sigma < 0.01


def test_a_wall_that_no_parabola_follows_is_in_its_deviation(sheet):
    rows, errors, sigmas = np.arange(20.0, 100.0), [], []
    for third in (0.0, 2e-9, 5e-9, -5e-9):
        crease = place_crease(walls(sheet, 100.0, third=third), rows, np.full(len(rows), 100.0))
        errors.append(abs(np.median(crease.nodes[:, 1]) - 100.0))
        sigmas.append(crease.sigma)
    assert sigmas[0] < 0.01
    assert min(errors[1:]) > 0.03
    np.testing.assert_allclose(sigmas, errors, rtol=0.05, atol=0.01)  # cubics follow these walls exactly


def test_a_gap_at_the_crease_is_in_its_deviation(sheet):
    found = walls(sheet, 100.0)
    measured = found.measured.copy()
    measured[:, 97:104] = False
    rows = np.arange(20.0, 100.0)
    crease = place_crease(replace(found, measured=measured), rows, np.full(len(rows), 100.0))
    assert crease.sigma == pytest.approx(7 / np.sqrt(12.0), rel=0.1)
