"""Texture coordinates outside of 0…1, in every format that has any."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from restore.errors import BadInput
from restore.formats import load_scan, write_obj, write_ply
from restore.formats.parsing.mesh import texture_pixels, texture_uv
from restore.formats.parsing.tiles import BORDER, in_first_tile

SINGLE_PX = 2e-3  # float32 of a coordinate below 8, in a picture of 640 pixels
TILES = [(1, 0), (0, -1), (-1, -1), (7, 2)]
TWO_CHARTS = np.array([[0, 1, 2], [3, 4, 5]])
CHART = np.array([[0.2, 0.1], [0.8, 0.1], [0.5, 0.9]])


def write_glb(mesh, path):
    visual = trimesh.visual.TextureVisuals(
        texture_uv(mesh.texcoords, mesh.texture), image=Image.fromarray(mesh.texture)
    )
    path.write_bytes(trimesh.Trimesh(mesh.vertices, mesh.faces, visual=visual, process=False).export(file_type="glb"))


def write_wrl(mesh, path):
    uv = texture_uv(mesh.texcoords, mesh.texture)
    rows = [", ".join(f"{' '.join(map(repr, row))}" for row in table.tolist()) for table in (mesh.vertices, uv)]
    faces = ", ".join(f"{a}, {b}, {c}, -1" for a, b, c in mesh.faces.tolist())
    path.write_text(
        f'#VRML V1.0 ascii\nSeparator {{ Texture2 {{ filename "{path.stem}.png" }}\n'
        f"Coordinate3 {{ point [ {rows[0]} ] }}\nTextureCoordinate2 {{ point [ {rows[1]} ] }}\n"
        f"IndexedFaceSet {{ coordIndex [ {faces} ] }} }}\n"
    )
    Image.fromarray(mesh.texture).save(path.with_suffix(".png"))


WRITERS = {".obj": write_obj, ".ply": write_ply, ".glb": write_glb, ".wrl": write_wrl}


@pytest.mark.parametrize("tile", TILES)
@pytest.mark.parametrize("ending", WRITERS)
def test_a_mesh_in_another_tile_shows_the_picture(mesh, tmp_path, ending, tile):
    sheet = mesh(rows=24, cols=32)
    height, width = sheet.texture.shape[:2]
    WRITERS[ending](sheet, tmp_path / f"a{ending}")
    WRITERS[ending](
        replace(sheet, texcoords=sheet.texcoords + np.multiply(tile, (width, -height))), tmp_path / f"b{ending}"
    )
    here, there = load_scan(tmp_path / f"a{ending}"), load_scan(tmp_path / f"b{ending}")
    np.testing.assert_allclose(there.texture_xy, here.texture_xy, atol=SINGLE_PX, rtol=0)
    np.testing.assert_array_equal(there.texture, sheet.texture)


def test_every_chart_comes_back_from_its_own_tile():
    uv = np.concatenate([CHART + [2, -1], CHART + [0, 4]])
    np.testing.assert_allclose(in_first_tile(Path("a.obj"), uv, TWO_CHARTS), np.tile(CHART, (2, 1)), atol=1e-15)


def test_coordinates_a_little_outside_stay():
    uv = np.concatenate([CHART * 1.2 - 0.1, CHART + [0.2 + 0.99 * BORDER, 0]])
    assert in_first_tile(Path("a.obj"), uv, TWO_CHARTS) is uv


@pytest.mark.parametrize("stretch, shift", [(2.0, 0.0), (1.0, 0.5), (3.5, -1.25)])
def test_a_piece_on_which_the_picture_repeats_is_refused(mesh, tmp_path, stretch, shift):
    sheet = mesh(whole=True)
    uv = texture_uv(sheet.texcoords, sheet.texture) * [stretch, 1.0] + [shift, 0.0]
    write_obj(replace(sheet, texcoords=texture_pixels(uv, sheet.texture)), tmp_path / "a.obj")
    with pytest.raises(BadInput, match=r"a\.obj: texture coordinates .* repeat its image"):
        load_scan(tmp_path / "a.obj")


def test_a_photograph_that_shows_less_than_the_surface_stays_where_it_is():
    uv = CHART * 1.8 - 0.4
    np.testing.assert_array_equal(in_first_tile(Path("a.obj"), uv, TWO_CHARTS[:1]), uv)
