"""Clouds of text: any order of columns, separators, decimal commas, names, counts."""

import numpy as np
import pytest

from oracles.clouds import write_text
from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.clouds.text import read_text

ORDERS = ("x y z", "x y z r g b", "x y z i r g b", "r g b x y z")


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(
    ("separator", "comma"), [(" ", False), ("\t", False), (",", False), (";", True), (" ", True), (", ", False)]
)
def test_columns_follow_from_their_values(tmp_path, sheet, order, separator, comma):
    write_text(tmp_path / "a.xyz", sheet, order=order, separator=separator, comma=comma)
    cloud = read_text(tmp_path / "a.xyz")
    np.testing.assert_allclose(cloud.points, (sheet.points * [1, -1, -1])[sheet.measured], atol=1e-4)
    assert (cloud.colours is None) == (order == "x y z")


@pytest.mark.parametrize(
    ("name", "order", "first", "separator"),
    [
        ("a.txt", "i z y x b g r", "//Intensity Z Y X B G R\n", " "),
        ("a.csv", "y x z b g r", "Y [mm];X [mm];Z [mm];Blue;Green;Red\n", ";"),
        ("a.csv", "x y z r g b", '"x","y","z","red","green","blue"\n', ","),
        ("a.pts", "x y z i r g b", "{count}\n", " "),
        ("a.asc", "x y z r g b", "# a scan of 2024\n# x y z of a page\n", " "),
    ],
)
def test_first_lines_name_columns_or_count_points(tmp_path, sheet, name, order, first, separator):
    write_text(tmp_path / name, sheet, order=order, first=first, separator=separator)
    cloud = read_text(tmp_path / name)
    np.testing.assert_allclose(cloud.points, (sheet.points * [1, -1, -1])[sheet.measured], atol=1e-4)
    assert cloud.colours[:, 0].std() > 1
    assert np.abs(cloud.colours.astype(int)[:, 0] - np.nonzero(sheet.measured)[1]).max() == 0  # red is the column


def test_normals_fractions_and_numbers_of_points(tmp_path):
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points, colours = rng.uniform(-100, 100, (500, 3)), rng.random((500, 3))
    np.savetxt(tmp_path / "a.txt", np.hstack([np.arange(500)[:, None], points, normals, colours]), "%.6f")
    cloud = read_text(tmp_path / "a.txt")
    np.testing.assert_allclose(cloud.points, points, atol=1e-6)
    np.testing.assert_allclose(cloud.normals, normals, atol=1e-6)
    np.testing.assert_allclose(cloud.colours, 255 * colours, atol=0.51)


def test_values_that_are_missing(tmp_path):
    (tmp_path / "a.csv").write_text("x;y;z;r;g;b\n1,5;2;3;9;8;7\n;;;;;\n4;5;;1;2;3\n7;8;9;1;2;3\n")
    cloud = read_text(tmp_path / "a.csv")
    assert cloud.measured.tolist() == [True, False, False, True]
    assert cloud.points[0].tolist() == [1.5, 2, 3]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("hello\nworld\n", "no points"),
        ("1 2\n3 4\n", "not 2 numbers"),
        ("1 2 3\n4 5\n", "not 3 numbers"),
        ("1 2 3\n4 five 6\n", "not a number"),
        ("1 2 3\n1e30 1 1\n", "lies at"),
        ("0 0 0\n0 0 0\n", "no point that was measured"),
        ("\0\0\0", "not text"),
    ],
)
def test_what_is_not_a_cloud_is_refused(tmp_path, text, fault):
    (tmp_path / "a.xyz").write_text(text)
    with pytest.raises(BadInput, match=fault):
        load_scan(tmp_path / "a.xyz")
