"""HEIC is known by its first bytes; what its reader gives to photographs stands in test_photograph.py."""

from pathlib import Path

import pytest

from restore.photo.heif import HeifPicture, is_heif

PICTURE = Path(__file__).with_name("turned.heic")


@pytest.mark.parametrize(
    ("head", "still"),
    [
        (b"\0\0\0\x18ftypheic", True),
        (b"\0\0\0\x18ftypmif1", True),
        (b"\0\0\0\x18ftypisom", False),  # a video
        (b"\0\0\0\x18ftypavif", False),
        (b"\x89PNG\r\n\x1a\n\0\0\0\r", False),
        (b"ftypheic", False),
        (b"", False),
    ],
)
def test_a_still_picture_is_distinguished_from_other_files(head, still):
    assert is_heif(head) is still


def test_size_and_pixels_are_upright_and_the_tag_is_reported():
    pytest.importorskip("pi_heif")
    data = PICTURE.read_bytes()
    assert is_heif(data[:12])
    opened = HeifPicture(data)
    picture, tag = opened.decoded()
    assert picture.size == opened.size
    assert tag == 6
