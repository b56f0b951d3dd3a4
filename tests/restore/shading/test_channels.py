"""Channel-wise operations agree with numpy's along the last axis."""

import numpy as np
import pytest

from restore.shading.channels import as_list, highest, lowest, scaled, total_of

SINGLE = 1e-6  # relative
FIELD = np.random.default_rng(3).uniform(0.1, 1.0, (5, 7, 3)).astype(np.float32)


@pytest.mark.parametrize(("ours", "theirs"), [(lowest, np.min), (highest, np.max), (total_of, np.sum)])
def test_over_the_channels(ours, theirs):
    np.testing.assert_allclose(ours(FIELD), theirs(FIELD, axis=2), rtol=SINGLE)


def test_each_channel_has_its_own_factor():
    np.testing.assert_allclose(scaled(FIELD, np.array([1.0, 2.0, 0.5])), FIELD * [1.0, 2.0, 0.5], rtol=SINGLE)


def test_a_list_has_the_cells_in_order():
    np.testing.assert_array_equal(as_list(FIELD)[9], FIELD[1, 2])
    np.testing.assert_array_equal(as_list(FIELD[..., 0])[9], FIELD[1, 2, 0])
