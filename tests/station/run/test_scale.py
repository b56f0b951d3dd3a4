"""`planish restore --scale`: the size of a page whose mesh has no true unit."""

from __future__ import annotations

import json

import numpy as np
import pytest

from restore import save_scan
from restore.formats import read_image, write_obj
from restore.scan import SurfaceMesh
from station.cli import main

SIZE_MM = 0.05  # a third of a thousandth: the arcs of 5 mm are known by their ends alone


def curled(scale: float) -> SurfaceMesh:
    """A page of 150 × 100 mm on a cylinder of radius 60 mm, in a unit of its own."""
    along, across = np.meshgrid(np.linspace(0, 150, 31), np.linspace(0, 100, 21))
    angle = along / 60.0
    vertices = np.stack([60 * np.sin(angle), across, 60 * np.cos(angle)], axis=-1).reshape(-1, 3) * scale
    index = np.arange(along.size).reshape(along.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    return SurfaceMesh(
        vertices, np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, d), (a, d, c))])
    )


@pytest.fixture
def mesh_file(tmp_path):
    def written(scale: float):
        write_obj(curled(scale), tmp_path / "page.obj")
        return tmp_path / "page.obj"

    return written


@pytest.mark.parametrize(("scale", "size"), [(0.1, "150x100"), (173.0, "100 × 150")])  # cm, and an unknown unit
def test_a_page_of_any_unit_has_the_size_that_is_given(mesh_file, tmp_path, capsys, scale, size):
    given = ["restore", str(mesh_file(scale)), "-o", str(tmp_path / "out"), "--scale", size, "--dpi", "50", "--json"]
    assert main(given) == 0
    report = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(report["page_mm"], [150.0, 100.0], atol=SIZE_MM)
    assert report["scale"] == size


@pytest.mark.parametrize(
    ("size", "code", "sentence"),
    [("150x110", 3, "as 1.500 to 1"), ("card", 2, "'card' is not a scale"), ("0x5", 2, "'0x5' is not a scale")],
)
def test_other_sizes_are_refused(mesh_file, tmp_path, capsys, size, code, sentence):
    assert main(["restore", str(mesh_file(1.0)), "-o", str(tmp_path / "out"), "--scale", size]) == code
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_range_image_has_its_own_scale(scan, tmp_path, capsys):
    save_scan(scan, tmp_path / "shot.scan")
    assert main(["restore", str(tmp_path / "shot.scan"), "-o", str(tmp_path / "out"), "--scale", "150x100"]) == 2
    assert "own scale" in capsys.readouterr().err


def test_a_mirror_image_is_mirrored(mesh_file, tmp_path, capsys):
    source = mesh_file(1.0)
    for folder, options in (("plain", []), ("mirrored", ["--mirror"])):
        assert main(["restore", str(source), "-o", str(tmp_path / folder), "--dpi", "50", "--map", *options]) == 0
    capsys.readouterr()
    assert json.loads((tmp_path / "mirrored" / "page.json").read_text())["mirrored"] is True
    plain, mirrored = ((tmp_path / name / "page.png") for name in ("plain", "mirrored"))
    np.testing.assert_array_equal(read_image(mirrored), read_image(plain)[:, ::-1])
