"""The flag-XYZ range image."""

import gzip

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from restore.errors import BadInput
from restore.formats import load_scan, write_abs
from restore.scan import RangeScan

HALF_DIGIT_MM = 0.51e-6  # the text has six decimals

HEADER = "2 rows\n3 columns\npixels (flag X Y Z):\n"
BODY = "1 1 0 1 1 1\n1 2 -999999 4 5 6\n1 1 -999999 1 1 1\n-9 -9 -999999 -9 -9 -9\n"

grids = st.tuples(st.integers(1, 6), st.integers(1, 6)).flatmap(
    lambda shape: arrays(np.float64, (*shape, 3), elements=st.floats(-2500, 2500).filter(lambda x: abs(x) > 1e-6))
)


@pytest.mark.parametrize("name", ["page.abs", "page.abs.gz"])
def test_a_scan_comes_back_with_its_picture(shot, tmp_path, name):
    scan = shot(whole=True)
    write_abs(scan, tmp_path / name)
    Image.fromarray(scan.texture).save(tmp_path / "page.png")
    back = load_scan(tmp_path / name)
    np.testing.assert_allclose(back.points, scan.points, atol=HALF_DIGIT_MM, rtol=0)
    np.testing.assert_array_equal(back.texture, scan.texture)
    np.testing.assert_array_equal(back.texture_xy, scan.texture_xy)


@settings(deadline=None, max_examples=50)
@given(points=grids, lost=st.randoms(use_true_random=False))
def test_any_grid_comes_back(points, lost, tmp_path_factory):
    points = points.copy()
    points[[[lost.random() < 0.3 for _ in row] for row in points]] = np.nan
    path = tmp_path_factory.mktemp("abs") / "grid.abs"
    write_abs(RangeScan(points, None, np.zeros((*points.shape[:2], 2))), path)
    np.testing.assert_allclose(load_scan(path).points, points, atol=HALF_DIGIT_MM, rtol=0)


@pytest.mark.parametrize(
    "text",
    [
        HEADER + BODY,
        "2  rows  \n 3 columns of samples\nPixels (flag X Y Z)\n" + BODY,
        HEADER.replace("\n", "\r\n") + BODY.replace(" ", "\n"),
        HEADER + BODY.replace("-999999", "0"),
        HEADER + BODY.replace("-999999", "nan"),
        HEADER + BODY.replace("-999999", "-999999.000000"),
    ],
)
def test_headers_and_marks_of_absence_differ_in_the_wild(tmp_path, text):
    (tmp_path / "wild.abs").write_bytes(text.encode())
    scan = load_scan(tmp_path / "wild.abs")
    assert scan.measured.tolist() == [[True, True, False], [True, True, True]]
    assert scan.points[1, 2].tolist() == [6, 1, -9]


def test_a_sample_flagged_as_absent_has_no_point_whatever_its_coordinates(tmp_path):
    (tmp_path / "flag.abs").write_text(HEADER + BODY.replace("-999999", "7"))
    assert not load_scan(tmp_path / "flag.abs").measured[0, 2]


def test_a_fast_sample_lies_in_the_middle_of_its_four_pixels(shot, tmp_path):
    scan = shot(whole=True, thinned=2)
    write_abs(scan, tmp_path / "fast.abs")
    Image.fromarray(scan.texture).save(tmp_path / "fast.png")
    back = load_scan(tmp_path / "fast.abs")
    assert back.texture_xy[0, 0].tolist() == [0.5, 0.5]
    np.testing.assert_array_equal(back.texture_xy, scan.texture_xy)


def test_the_next_number_is_the_picture_in_the_challenges_naming(shot, tmp_path):
    scan = shot(whole=True)
    write_abs(scan, tmp_path / "02463d099.abs.gz")
    Image.fromarray(scan.texture).save(tmp_path / "02463d100.ppm")
    np.testing.assert_array_equal(load_scan(tmp_path / "02463d099.abs.gz").texture, scan.texture)


def test_without_a_picture_the_samples_lie_on_the_grid_itself(shot, tmp_path):
    write_abs(shot(), tmp_path / "bare.abs")
    scan = load_scan(tmp_path / "bare.abs")
    assert scan.texture is None
    assert scan.texture_xy[3, 5].tolist() == [5, 3]


def test_a_picture_of_another_shape_is_refused(shot, tmp_path):
    write_abs(shot(), tmp_path / "page.abs")
    Image.new("RGB", (320, 320)).save(tmp_path / "other.png")
    with pytest.raises(BadInput, match=r"page\.abs: the image of 320 × 320 pixels does not fit"):
        load_scan(tmp_path / "page.abs", tmp_path / "other.png")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("solid\n", "must begin with rows, columns and pixels"),
        ("0 rows\n3 columns\npixels\n", "0 rows and 3 columns cannot be"),
        ("99999 rows\n99999 columns\npixels\n", "99999 rows and 99999 columns cannot be"),
        (HEADER + BODY + "7\n", "holds 25 numbers, 2 × 3 samples need 24"),
        (HEADER + BODY[:-4], "seems cut short: it holds 23 numbers"),
        (HEADER, "seems cut short: it holds 0 numbers"),
        (HEADER + BODY.replace("5", "five"), "holds b'five', which is not a number"),
        (HEADER + BODY.replace("5", "1e9"), "beyond 100000 mm"),
    ],
)
def test_a_damaged_text_is_named(tmp_path, text, fault):
    (tmp_path / "bad.abs").write_text(text)
    with pytest.raises(BadInput, match=f"bad.abs.*{fault}") as caught:
        load_scan(tmp_path / "bad.abs")
    assert caught.value.hint


@pytest.mark.parametrize(
    ("damage", "fault"),
    [
        (lambda data: data[:-9], "seems cut short"),
        (lambda data: data[: len(data) // 2], "seems cut short"),
        (lambda data: data[:20], "must begin with rows"),
        (lambda data: data[:40] + b"\xff" * 9 + data[49:], "does not unpack"),
    ],
)
def test_a_damaged_archive_is_named(shot, tmp_path, damage, fault):
    write_abs(shot(), tmp_path / "bad.abs.gz")
    (tmp_path / "bad.abs.gz").write_bytes(damage((tmp_path / "bad.abs.gz").read_bytes()))
    with pytest.raises(BadInput, match=rf"bad\.abs\.gz.*{fault}"):
        load_scan(tmp_path / "bad.abs.gz")


def test_an_archive_that_unpacks_to_more_than_its_samples_stops_there(tmp_path):
    (tmp_path / "bomb.abs.gz").write_bytes(gzip.compress(HEADER.encode() + b" 1" * 10**6))
    with pytest.raises(BadInput, match="unpacks to more than its samples can fill"):
        load_scan(tmp_path / "bomb.abs.gz")


def test_a_small_archive_does_not_unpack_to_a_large_grid(tmp_path):
    (tmp_path / "bomb.abs.gz").write_bytes(gzip.compress(b"1400 rows\n1400 columns\npixels\n" + b" " * 50_000_000))
    with pytest.raises(BadInput, match="unpacks to more"):
        load_scan(tmp_path / "bomb.abs.gz")
