"""ICC profiles, as the colour engine that others use (LittleCMS, in Pillow) understands them."""

from __future__ import annotations

import io
import struct

import numpy as np
import pytest
from PIL import Image, ImageCms

from station.images.icc import D50, D65, MatrixProfile, adaptation, encode_profile, srgb_matrix, srgb_profile

FIXED = 2**-16  # numbers in a profile are counted in these
CODE = 1  # of 255: two roundings on the way there and back


def transformed(source: bytes, target: bytes, codes: np.ndarray) -> np.ndarray:
    profiles = (ImageCms.ImageCmsProfile(io.BytesIO(data)) for data in (source, target))
    turn = ImageCms.buildTransform(*profiles, "RGB", "RGB", ImageCms.Intent.RELATIVE_COLORIMETRIC)
    picture = ImageCms.applyTransform(Image.fromarray(codes), turn)
    assert picture is not None
    return np.asarray(picture).astype(int)


@pytest.fixture
def codes():
    return np.random.default_rng(3).integers(0, 256, (32, 32, 3), np.uint8)


def test_srgb_is_that_of_other_programs(codes):
    theirs = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    assert np.abs(transformed(srgb_profile(), theirs, codes) - codes).max() <= CODE


def test_white_is_the_white_of_all_profiles():
    np.testing.assert_allclose(srgb_matrix() @ np.ones(3), D50, atol=1e-6)
    np.testing.assert_allclose(adaptation(D65) @ D65, D50, atol=1e-12)


def test_another_matrix_and_curve_change_colours_as_given(codes):
    swapped = MatrixProfile("red for blue", srgb_matrix()[:, ::-1], ((1.0, 1.0, 0.0, 1.0, 0.0),) * 3, kind="scnr")
    there = transformed(encode_profile(swapped), srgb_profile(), codes)
    light = codes[..., ::-1] / 255
    srgb = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert np.abs(there - srgb * 255).max() <= 2 * CODE  # linear codes are coarse in the dark


def test_layout_is_as_the_standard_asks():
    data = srgb_profile()
    size, version, kind, space, pcs = struct.unpack_from(">I4xI4s4s4s", data)
    assert (size, version, kind, space, pcs) == (len(data), 0x04300000, b"mntr", b"RGB ", b"XYZ ")
    assert data[36:40] == b"acsp"
    (count,) = struct.unpack_from(">I", data, 128)
    for i in range(count):
        _, at, length = struct.unpack_from(">4sII", data, 132 + 12 * i)
        assert at % 4 == 0
        assert at + length <= len(data)
    assert np.abs(np.array(struct.unpack_from(">3i", data, 68)) * FIXED - D50).max() < FIXED


def test_the_same_profile_is_the_same_bytes():
    assert encode_profile(MatrixProfile("a", srgb_matrix(), ((1.0, 1.0, 0.0, 1.0, 0.0),) * 3)) == encode_profile(
        MatrixProfile("a", srgb_matrix(), ((1.0, 1.0, 0.0, 1.0, 0.0),) * 3)
    )
