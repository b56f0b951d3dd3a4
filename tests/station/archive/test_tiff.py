"""A TIFF master: the pixels of the page, its resolution and profile, and where it comes from."""

from __future__ import annotations

import numpy as np
import tifffile
from PIL import Image

from station.archive.tiff import encode_master
from station.archive.volume import Role
from station.images.icc import srgb_profile
from station.images.pages import read_page
from tests.station.archive.conftest import DPI

ICC, MODEL = 34675, 272  # tags


def test_the_master_is_the_page(volume, tmp_path) -> None:
    page = volume.pages[1]
    picture = page.find(Role.PAGE).path
    (tmp_path / "m.tif").write_bytes(encode_master(page, read_page(picture)))
    with tifffile.TiffFile(tmp_path / "m.tif") as file:
        np.testing.assert_array_equal(file.asarray(), np.asarray(Image.open(picture)))
        tags = file.pages[0].tags
        across, unit = tags["XResolution"].value, tags["ResolutionUnit"].value
        assert unit == 2  # inch
        assert across[0] / across[1] == DPI  # not 150.012, as a PNG has it
        assert tags[ICC].value == srgb_profile()
        assert tags[MODEL].value == "VIVID 900"
