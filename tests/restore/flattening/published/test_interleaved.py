"""The order in which sticks are gone over."""

import numpy as np
import pytest

from restore.flattening.published.stick_kernels import BLOCK, interleave, interleaved_order

APART = 100  # places in the list: more than the sticks of a vertex and of its neighbours


@pytest.mark.parametrize("count", [0, 1, 2, 1000, BLOCK, 3 * BLOCK + 17])
def test_everything_is_in_the_order_once(count):
    np.testing.assert_array_equal(np.sort(interleaved_order(count)), np.arange(count))


def test_neighbours_in_the_list_are_not_neighbours_on_the_sheet():
    order = interleaved_order(BLOCK)
    assert np.abs(np.diff(order)).min() > APART


def test_pairs_keep_their_lengths():
    pairs = np.stack([np.arange(50), np.arange(50) + 1], axis=1)
    mixed, lengths = interleave(pairs, pairs[:, 0] * 2.0)
    assert not np.array_equal(mixed, pairs)
    np.testing.assert_array_equal(lengths, mixed[:, 0] * 2.0)
