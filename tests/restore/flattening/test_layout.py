"""Pieces that lie over each other are moved apart, and nothing else."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from oracles.overlaps import overlapping_pairs
from restore.flattening.layout import arrange_pieces

ROUNDING = 1e-9
SIDE = 5  # vertices along a side of a piece

places = st.tuples(*[st.floats(-100.0, 100.0)] * 2)
sizes = st.tuples(*[st.floats(10.0, 120.0)] * 2)
rectangles = st.lists(st.tuples(places, sizes, st.floats(0.0, 3.0)), min_size=2, max_size=6)


def pieces(*rectangles):
    """Flat positions (n, 2), and of every rectangle (place, size, turn) its vertices and its own faces."""
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, SIDE)] * 2), axis=-1).reshape(-1, 2)
    k = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = k[:-1, :-1].ravel(), k[:-1, 1:].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    flat = [
        grid * size @ np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]]) + place
        for place, size, t in rectangles
    ]
    parts = [(np.arange(SIDE**2) + i * SIDE**2, faces) for i in range(len(rectangles))]
    return np.concatenate(flat), parts


def between(flat, parts):
    """How many pairs of faces of different pieces overlap."""
    faces = np.concatenate([vertices[own] for vertices, own in parts])
    owner = np.repeat(np.arange(len(parts)), [len(own) for _, own in parts])
    pairs = overlapping_pairs(flat, faces)
    return int((owner[pairs[:, 0]] != owner[pairs[:, 1]]).sum())


def test_pieces_apart_stay_where_they_are():
    flat, parts = pieces(((0, 0), (50, 50), 0), ((60, 0), (20, 80), 0.0), ((0, 100), (40, 10), 0.3))
    before = flat.copy()
    arrange_pieces(flat, parts)
    np.testing.assert_array_equal(flat, before)


def test_the_smaller_of_two_over_each_other_moves_off_by_the_shorter_way():
    flat, parts = pieces(((0, 0), (100, 100), 0), ((80, 40), (40, 20), 0.0))
    before = flat.copy()
    assert between(flat, parts) > 0
    arrange_pieces(flat, parts)
    assert between(flat, parts) == 0
    np.testing.assert_array_equal(flat[parts[0][0]], before[parts[0][0]])
    shift = (flat - before)[parts[1][0]]
    np.testing.assert_allclose(shift, shift[:1].repeat(len(shift), 0), atol=ROUNDING)
    assert 20 < shift[0, 0] < 25  # to the right, where it lay, and as little as that takes


def test_pieces_at_one_place_come_apart():
    flat, parts = pieces(*[((0, 0), (30, 30), 0.0)] * 4)
    arrange_pieces(flat, parts)
    assert between(flat, parts) == 0


@settings(max_examples=30, deadline=None)
@given(rectangles)
def test_whatever_lay_over_another_does_so_no_more(found):
    flat, parts = pieces(*sorted(found, key=lambda r: -r[1][0] * r[1][1]))
    before = flat.copy()
    arrange_pieces(flat, parts)
    assert between(flat, parts) == 0
    for vertices, _ in parts:
        shift = (flat - before)[vertices]
        np.testing.assert_allclose(shift, shift[:1].repeat(len(shift), 0), atol=ROUNDING)  # neither turned nor bent


def test_one_piece_is_left_alone():
    flat, parts = pieces(((5, 5), (30, 30), 0.4))
    before = flat.copy()
    arrange_pieces(flat, parts)
    np.testing.assert_array_equal(flat, before)
