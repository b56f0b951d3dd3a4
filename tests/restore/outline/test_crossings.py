"""Straight sides that pass between samples, askew in the picture."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restore.outline import crossings as module
from restore.outline.crossings import SHARED, WRONG, Crossings, PictureEdge, separate

ROWS = 400
PITCH_MM = 0.47
STEP = 0.01  # samples: two of the last places that are compared
LOST = 0.1
OUTWARDS = np.array([0.0, 1.0])


def crossings(edge, lost=0.0, ragged=0.0, seed=0):
    """Crossings of rows of samples with an edge (n,) samples down; some end a sample early, and all where noise says.

    On the page the edge is at y = 0, and y points outwards.
    """
    rng = np.random.default_rng(seed)
    ends = np.floor(edge + ragged * rng.normal(size=len(edge)))
    ends -= rng.random(len(edge)) < lost
    across = np.stack([ends - edge, ends + 1.0 - edge], axis=1)
    along = np.broadcast_to(np.arange(len(edge), dtype=float)[:, None], across.shape)
    samples = np.stack([along, across], axis=2)
    nodes = np.stack([along[:, 0], ends + 0.5], axis=1)
    return Crossings(nodes, PITCH_MM * samples, np.tile(np.eye(2) / PITCH_MM, (len(edge), 1, 1)))


def offset(found):
    return separate(found, OUTWARDS).offset / PITCH_MM


def tilted(steps, start=0.3):
    """An edge that runs down by so many samples, and so passes each row at another part of one."""
    return start + steps * np.linspace(0.0, 1.0, ROWS)


# Rows meet the edge at parts of a sample 1/400 · steps apart: the nearest samples on both sides tell it to that. The
# mean of the crossings is off by up to an eighth of a sample / steps.
@given(st.floats(3.0, 30.0), st.floats(0.0, 1.0))
def test_a_clean_edge_is_located_to_a_hundredth_of_a_sample(steps, start):
    assert abs(offset(crossings(tilted(steps, start)))) < STEP + 0.5 * steps / ROWS


@given(st.floats(3.0, 30.0), st.integers(0, 1000))
def test_lost_samples_do_not_draw_the_side_in(steps, seed):
    found = crossings(tilted(steps), LOST, seed=seed)
    assert abs(found.samples.mean(axis=1)[:, 1].mean() / PITCH_MM) > 0.3 * LOST  # the mean of the crossings is drawn in
    assert abs(offset(found)) < 0.4 * LOST


def test_an_edge_along_the_rows_is_midway_even_if_samples_are_lost():
    edge = np.full(ROWS, 7.9)
    assert offset(crossings(edge)) == pytest.approx(-0.4, abs=STEP)
    assert offset(crossings(edge, LOST)) == pytest.approx(-0.4, abs=0.1)


def test_views_locate_edges_along_rows_and_no_others():
    seen = PictureEdge(0.0, 0.1 * PITCH_MM)
    along = crossings(np.full(ROWS, 7.7))
    assert offset(along) == pytest.approx(-0.2, abs=STEP)
    # A tenth of a sample off where it was seen is two thirds as likely, and the samples are for places midway.
    assert separate(along, OUTWARDS, seen).offset / PITCH_MM == pytest.approx(0.0, abs=0.05)
    tilted_row, off = crossings(tilted(9.0)), seen._replace(offset=0.5 * PITCH_MM)
    assert separate(tilted_row, OUTWARDS, off).offset / PITCH_MM == pytest.approx(offset(tilted_row), abs=2 * STEP)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_samples_along_a_row_that_err_together_do_not_outvote_the_picture(monkeypatch, sign):
    """They all lie on the wrong side of the edge, by 0.03 samples, and the picture shows it where it is."""
    row = crossings(np.full(ROWS, 7.0 if sign < 0 else 7.999))
    seen = PictureEdge(sign * 0.03 * PITCH_MM, 0.1 * PITCH_MM)
    off = separate(row, OUTWARDS, seen).offset - seen.offset
    monkeypatch.setattr(module, "SHARED", 0.0)
    outvoted = separate(row, OUTWARDS, seen).offset - seen.offset
    assert -sign * outvoted / PITCH_MM > 0.1
    assert abs(off) < 0.6 * abs(outvoted)


@given(st.floats(0.0, 9.0), st.floats(0.0, 1.0))
def test_the_more_rows_a_side_crosses_the_less_its_samples_err_together(steps, start):
    shared = module._shared_error(crossings(tilted(steps, start)))
    # Half of them on either of two rows count as √3 rows.
    assert SHARED / shared == pytest.approx(1.0 + steps, abs=1.74)


def test_a_ragged_edge_is_where_its_crossings_are_in_the_mean():
    off = [offset(crossings(tilted(9.0), ragged=0.6, seed=seed)) for seed in range(20)]
    # 400 crossings that scatter by 0.67 samples have a mean within 0.034; samples that may be wrong cost some of it.
    assert np.std(off) < 0.05
    assert abs(np.mean(off)) < 3 * 0.05 / np.sqrt(20)


def test_normals_point_outwards():
    found = crossings(tilted(9.0))
    turned = found._replace(samples=-found.samples + [0.0, 40.0])
    assert separate(turned, -OUTWARDS).offset == pytest.approx(-40.0, abs=STEP * PITCH_MM)


def test_more_lost_samples_than_are_reckoned_with_do_less_harm_than_to_the_mean():
    found = crossings(tilted(9.0), 1.5 * WRONG)
    assert abs(offset(found)) < abs(found.samples.mean(axis=1)[:, 1].mean() / PITCH_MM)


def test_samples_that_agree_outweigh_a_picture_of_another_edge():
    """A texture finer than the samples shows the end of what pads it, without scatter."""
    found = separate(crossings(tilted(8.0)), OUTWARDS, PictureEdge(0.9 * PITCH_MM, 0.02 * PITCH_MM))
    assert abs(found.offset) < 2 * STEP * PITCH_MM
    assert found.right > 0.99


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9])
def test_a_picture_places_a_side_along_the_rows(part):
    sigma = 0.1 * PITCH_MM
    edge = np.full(ROWS, 7.0 + part)  # on the page y = 0
    assert abs(separate(crossings(edge), OUTWARDS, PictureEdge(0.0, sigma)).offset) < sigma
