"""Pictures are sampled without aliasing and without artefacts."""

from importlib import import_module

import numpy as np
import pytest

from restore.texture.sampling import sample_scaled

ROUNDED = 1e-3  # codes, single precision


def grid(height, width, step=1.0, start=0.0):
    return np.dstack(np.meshgrid(np.arange(width) * step + start, np.arange(height) * step + start)).astype(np.float32)


def test_the_identity_map_returns_the_picture(rng):
    picture = rng.integers(0, 256, (20, 30, 3), np.uint8)
    np.testing.assert_allclose(sample_scaled(picture, grid(20, 30)), picture, atol=ROUNDED)


def test_catmull_rom_keeps_parabolas():
    x = np.arange(40.0)
    picture = np.tile((x**2 / 8)[None, :, None], (20, 1, 3)).astype(np.uint8)
    picture = np.tile(np.round(4 * (x % 10 - 5) ** 2)[None, :, None], (20, 1, 3)).astype(np.uint8)
    at = np.stack(np.meshgrid(np.arange(13.0, 17.1, 0.5), np.arange(5.0, 9.0, 0.5)), axis=-1).astype(np.float32)
    np.testing.assert_allclose(sample_scaled(picture, at)[..., 0], 4 * (at[..., 0] - 15) ** 2, atol=ROUNDED)


@pytest.mark.parametrize("step", [1.3, 2.0, 3.7])
def test_stripes_finer_than_the_page_are_averaged_to_grey(step):
    """Read without a wider kernel they would come out as broad stripes that are not there."""
    picture = np.tile(((np.arange(400) % 2) * 255)[None, :, None], (60, 1, 3)).astype(np.uint8)
    found = sample_scaled(picture, grid(10, 60, step, 20.0))[..., 0]
    bound = {1.3: 80, 2.0: 6, 3.7: 6}[step]  # half a pixel a stripe is near the limit of 1.3 pixels
    assert np.abs(found - 127.5).max() < bound


def test_a_rotated_page_is_sampled_accurately(rng):
    picture = rng.integers(0, 256, (40, 30, 3), np.uint8)
    turned = np.ascontiguousarray(grid(40, 30).transpose(1, 0, 2))
    np.testing.assert_allclose(sample_scaled(picture, turned), picture.transpose(1, 0, 2), atol=ROUNDED)


def test_nan_positions_give_zero_and_the_border_pixel_is_replicated(rng):
    picture = rng.integers(0, 256, (8, 8, 3), np.uint8)
    source = grid(8, 8)
    source[2:4] = np.nan
    found = sample_scaled(picture, source)
    assert (found[2:4] == 0).all()
    np.testing.assert_allclose(found[0], picture[0], atol=ROUNDED)
    assert np.isfinite(sample_scaled(picture, grid(3, 3, 1.0, 50.0))).all()


def test_the_compiled_sampling_agrees_with_plain_python(rng, plain):
    picture = rng.integers(0, 256, (12, 14, 3), np.uint8)
    source = rng.uniform(-1, 14, (4, 5, 2)).astype(np.float32)
    compiled = sample_scaled(picture, source)
    assert {"_sample", "_kernel", "_fill_taps"} <= set(plain(import_module("restore.texture.sampling")))
    np.testing.assert_allclose(sample_scaled(picture, source), compiled, atol=ROUNDED)


def test_a_jump_to_another_chart_widens_no_kernel():
    """Beside a seam of an atlas the next page pixel lies far off in the picture; what is between them does not show."""
    picture = np.zeros((60, 200, 3), np.uint8)
    picture[:, 10:50], picture[:, 150:190] = 200, 200
    places = grid(20, 40, 0.8, 15.0)
    places[:, 20:, 0] += 125.0
    np.testing.assert_allclose(sample_scaled(picture, places), 200.0, atol=ROUNDED)
