"""`--white-balance`: the page in other colours, the master in those of its pictures."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from restore import BadInput
from station.cli import main
from station.images.conversion import convert_to_srgb
from station.images.icc import SRGB_CURVE, MatrixProfile, encode_profile, srgb_matrix, srgb_profile

ROUNDED = 1  # code: LittleCMS and the page are of 8 bits
# A lamp that gives a camera 4/5 of the green and half of the blue that it gives of red.
LAMP = np.array([1.0, 0.8, 0.5])
WARM = encode_profile(MatrixProfile("warm lamp", srgb_matrix() / LAMP, (SRGB_CURVE,) * 3, "scnr"))
SRGB = srgb_profile()


def codes(light):
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055) * 255


def test_greys_under_the_lamp_of_the_profile_become_neutral(page):
    light = np.linspace(0.05, 0.9, 50)[:, None] * LAMP
    height, width = page.image.shape[:2]
    image = np.resize(np.rint(codes(light)).astype(np.uint8), (height, width, 3))
    mask = np.ones((height, width), bool)
    mask[0] = False
    converted = convert_to_srgb(page.with_pictures(image=image, mask=mask), WARM)
    expected = np.resize(codes(np.linspace(0.05, 0.9, 50)), (height, width))
    # A dark code of blue is a step of two codes in light that the profile doubles.
    np.testing.assert_allclose(converted.image[1:], np.repeat(expected[1:, :, None], 3, axis=2), atol=2 * ROUNDED)
    np.testing.assert_array_equal(converted.image[0], image[0])
    assert converted.master is page.master
    assert converted.report["white_balance"] == {"setting": "profile", "icc_profile": "warm lamp"}


def test_a_page_in_srgb_stays_as_it_is(page):
    np.testing.assert_allclose(convert_to_srgb(page, SRGB).image, page.image, atol=ROUNDED)


def test_a_profile_without_its_colours_is_refused(page):
    with pytest.raises(BadInput, match="profile"):
        convert_to_srgb(page, WARM[:128] + bytes(len(WARM) - 128))


def test_the_page_is_srgb_and_the_master_keeps_codes_and_profile(library, scan_file, tmp_path):
    (tmp_path / "warm.icc").write_bytes(WARM)
    out = tmp_path / "out"
    assert (
        main(["restore", str(scan_file), "-o", str(out), "--white-balance", str(tmp_path / "warm.icc"), "--tiff"]) == 0
    )
    profiles = {}
    for name in ("book.png", "book.tif", "book-master.png"):
        with Image.open(out / name) as file:
            profiles[name] = file.info["icc_profile"]
    assert profiles == {"book.png": SRGB, "book.tif": SRGB, "book-master.png": WARM}
    page, master = (np.asarray(Image.open(out / name)) for name in ("book.png", "book-master.png"))
    assert (page != master).any()
    assert json.loads((out / "book.json").read_text())["white_balance"]["setting"] == "profile"


def test_the_setting_reaches_the_library_and_implies_a_master(library, scan_file, tmp_path):
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out"), "--white-balance", "paper"]) == 0
    assert (tmp_path / "out" / "book-master.png").exists()
    assert library.calls[0].white_balance == "paper"


@pytest.mark.parametrize(
    "options", [["--white-balance", "papper"], ["--white-balance", "warm.icc", "--icc-profile", "warm.icc"]]
)
def test_an_invalid_white_is_refused_before_any_work(library, scan_file, tmp_path, monkeypatch, options, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "warm.icc").write_bytes(WARM)
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out"), *options]) == 2
    assert "--white-balance" in capsys.readouterr().err
    assert library.calls == []
