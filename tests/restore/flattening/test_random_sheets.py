"""Random developable sheets come out whole: nothing fails, flips, overlaps or stretches."""

import numpy as np
import pytest

from oracles.outcome import MAX_STRAIN, Outcome, flatten_and_compare
from oracles.overlaps import overlapping_pairs
from oracles.random_sheets import KINDS, OUTLINES, random_sheet

ORDINARY, COUNT = 30, 200
TANGLED = [0, 133, 143, 252, 365]  # come down tangled, and need not stay so
STRAINED = [113]  # a noisy Miura fold of 346 vertices
UNTANGLED_MM = 0.4  # rms; a tangle puts whole spacings, 10 mm, in the wrong place


@pytest.mark.parametrize("seed", range(ORDINARY))
def test_a_random_sheet_comes_out_whole(seed):
    assert complaint(flatten_and_compare(random_sheet(seed))) == ""


@pytest.mark.parametrize("seed", TANGLED)
def test_a_tangle_is_undone_for_good(seed):
    assert flatten_and_compare(random_sheet(seed)).rms_mm < UNTANGLED_MM


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(seed, marks=pytest.mark.xfail(strict=True, reason="strained by 2.1 %"))
        if seed in STRAINED
        else seed
        for seed in range(ORDINARY, COUNT)
    ],
)
def test_every_other_one_does_too(seed):
    assert complaint(flatten_and_compare(random_sheet(seed))) == ""


def complaint(found: Outcome) -> str:
    """What is wrong with a page, empty when nothing is."""
    faults = {"flips": found.flips, "overlaps": found.overlaps, "strain": found.strain * (found.strain > MAX_STRAIN)}
    return found.failed or ", ".join(f"{name} {fault}" for name, fault in faults.items() if fault)


def test_a_seed_always_gives_the_same_sheet():
    one, other = random_sheet(7), random_sheet(7)
    np.testing.assert_array_equal(one.mesh.vertices, other.mesh.vertices)
    np.testing.assert_array_equal(one.mesh.faces, other.mesh.faces)


def test_there_are_sheets_of_every_kind_and_outline():
    sheets = [random_sheet(seed) for seed in range(60)]
    assert {sheet.kind for sheet in sheets} == set(KINDS)
    assert {sheet.outline for sheet in sheets} == set(OUTLINES)


@pytest.mark.parametrize(
    ("flat", "faces", "pairs"),
    [
        ([[0, 0], [2, 0], [0, 2], [1, 0.5], [3, 0.5], [1, 2.5]], [[0, 1, 2], [3, 4, 5]], 1),  # corner in face
        ([[0, 0], [4, 0], [0, 4], [1, 1], [1.5, 1], [1, 1.5]], [[0, 1, 2], [3, 4, 5]], 1),  # one in the other
        (
            [[0, 0], [6, 0], [3, 0.5], [3, -2], [3.5, 3], [2.5, 3]],
            [[0, 1, 2], [3, 4, 5]],
            1,
        ),  # across, no corner inside
        ([[0, 0], [2, 0], [0, 2], [0.5, 0.5]], [[0, 1, 2], [0, 1, 3]], 1),  # folded back over a common edge
        ([[0, 0], [2, 0], [0, 2], [2, 2]], [[0, 1, 2], [1, 3, 2]], 0),  # neighbours
        ([[0, 0], [2, 0], [0, 2], [-2, 0], [0, -2]], [[0, 1, 2], [0, 3, 4]], 0),  # a common corner
        ([[0, 0], [2, 0], [0, 2], [5, 5], [6, 5], [5, 6]], [[0, 1, 2], [3, 4, 5]], 0),
    ],
)
def test_overlapping_triangles_are_found_and_no_others(flat, faces, pairs):
    flat, faces = np.array(flat, float), np.array(faces)
    for order in (faces, faces[::-1], faces[:, [1, 2, 0]], faces[:, ::-1]):
        assert len(overlapping_pairs(flat, order)) == pairs


def test_overlaps_of_large_triangles_with_small_ones_are_found():
    flat = np.array([[-50, -50], [50, -50], [0, 60], [40, -49], [41, -49], [40, -48], [70, 0], [71, 0], [70, 1]], float)
    faces = np.arange(9).reshape(3, 3)
    assert {frozenset(pair) for pair in overlapping_pairs(flat, faces).tolist()} == {frozenset((0, 1))}
