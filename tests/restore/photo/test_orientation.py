"""Photographs whose orientation tags differ are turned so that their sensor lies alike."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import ExifTags, Image

from restore.photo import read_photograph
from restore.photo.orientation import turned_like
from restore.photo.photograph import Photograph

SENSOR = np.random.default_rng(1).integers(0, 256, (90, 140, 3), np.uint8)


@pytest.fixture
def tagged(tmp_path):
    """The sensor's picture, read from files with each of the eight tags."""
    photographs = {}
    for tag in range(1, 9):
        tags = Image.Exif()
        tags[ExifTags.Base.Orientation] = tag
        Image.fromarray(SENSOR).save(tmp_path / f"{tag}.png", exif=tags)
        photographs[tag] = read_photograph(tmp_path / f"{tag}.png")
    return photographs


@pytest.mark.parametrize("first", [1, 3, 6, 8])
@pytest.mark.parametrize("other", [1, 3, 6, 8])
def test_the_sensor_lies_as_in_the_first(tagged, first, other):
    turned = turned_like(tagged[other], tagged[first])
    np.testing.assert_array_equal(turned.image, tagged[first].image)
    assert turned.orientation == first
    assert turned.name == f"{other}.png"


@pytest.mark.parametrize("mirrored", [2, 4, 5, 7])
def test_what_a_tag_has_mirrored_back_stays(tagged, mirrored):
    assert turned_like(tagged[mirrored], tagged[6]) is tagged[mirrored]
    assert turned_like(tagged[6], tagged[mirrored]) is tagged[6]


def test_the_tag_is_kept(tagged):
    assert {tag: photograph.orientation for tag, photograph in tagged.items()} == {tag: tag for tag in range(1, 9)}
    assert Photograph(SENSOR).orientation == 1
