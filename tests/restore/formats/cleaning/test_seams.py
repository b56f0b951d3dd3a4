"""An atlas of charts becomes one picture: every place shows what its chart shows."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from restore import Settings, restore
from restore.formats import load_scan, write_obj
from restore.formats.cleaning.seams import without_seams
from restore.mesh.adjacency import components
from restore.mesh.raster import rasterise
from restore.mesh.topology import Topology
from restore.scan import SurfaceMesh

COLS, ROWS, STEP_MM, PX_PER_MM = 25, 17, 8.0, 4.0
SEAM = 11  # column
RADIUS_MM = 90.0
CODES = 6.0  # of 255: waves of 60 pixels, sampled twice
BY_A_SEAM = 25.0  # of 255: the last pixel of a chart, half of which may be black, is painted as its neighbour is
WIDTH, HEIGHT = (COLS - 1) * STEP_MM, (ROWS - 1) * STEP_MM


def picture():
    """A page of 192 × 128 mm with waves in all colours, and 20 pixels of the same round it."""
    y, x = np.mgrid[-20 : HEIGHT * PX_PER_MM + 21, -20 : WIDTH * PX_PER_MM + 21]
    waves = [np.sin(x / 19.0), np.cos(y / 23.0), np.sin((x + 2 * y) / 31.0)]
    return np.rint(127.5 + 120.0 * np.stack(waves, axis=-1)).astype(np.uint8)


def sheet(radius_mm=RADIUS_MM):
    """A curl (n, 3) mm, its faces, and where its vertices are in the picture."""
    across, down = np.meshgrid(np.arange(COLS) * STEP_MM, np.arange(ROWS) * STEP_MM)
    angle = (across - WIDTH / 2) / radius_mm
    vertices = np.stack([radius_mm * np.sin(angle), -down, radius_mm * np.cos(angle) - 700.0], axis=-1).reshape(-1, 3)
    index = np.arange(ROWS * COLS).reshape(ROWS, COLS)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, c, d), (a, d, b))])
    return vertices, faces, np.stack([across, down], axis=-1).reshape(-1, 2) * PX_PER_MM + 20.0


def atlas(vertices, faces, places):
    """The sheet in two charts, the right one turned upside down below the left one."""
    whole = picture()
    right = (faces % COLS).min(axis=1) >= SEAM
    count, shift = len(vertices), np.array([whole.shape[1] - 1.0, 2 * whole.shape[0] - 1.0])
    texcoords = np.concatenate([places, shift - places])
    return SurfaceMesh(
        np.concatenate([vertices, vertices]),
        np.where(right[:, None], faces + count, faces),
        texcoords,
        np.concatenate([whole, whole[::-1, ::-1]]),
    )


def shown(mesh, at):
    """(n, 3) codes of the picture of a mesh at texture pixels (n, 2)."""
    x, y = at.astype(np.float32).T
    return cv2.remap(mesh.texture, x[:, None], y[:, None], cv2.INTER_LINEAR)[:, 0].astype(float)


@pytest.mark.parametrize("turned", [False, True], ids=["", "faces the wrong way round"])
def test_every_place_shows_what_its_chart_showed(turned):
    vertices, faces, places = sheet()
    mesh = atlas(vertices, faces[:, ::-1] if turned else faces, places)
    joined = without_seams(mesh)
    assert len(joined.vertices) == len(vertices)
    assert components(Topology(joined.faces).edges, len(joined.vertices)).max() == 0
    assert joined.provenance["charts"] == 2
    middles, of_charts = (part.texcoords[part.faces].mean(axis=1) for part in (joined, mesh))
    np.testing.assert_allclose(shown(joined, middles), shown(mesh, of_charts), atol=CODES)


def test_a_page_from_charts_is_the_page_from_one_picture(tmp_path):
    vertices, faces, places = sheet()
    write_obj(atlas(vertices, faces, places), tmp_path / "atlas.obj")
    write_obj(SurfaceMesh(vertices, faces, places, picture()), tmp_path / "whole.obj")
    charts, whole = (restore(load_scan(tmp_path / f"{name}.obj"), Settings(dpi=80)) for name in ("atlas", "whole"))
    np.testing.assert_allclose(charts.report["page_mm"], whole.report["page_mm"], atol=1e-3)
    assert not any("pieces" in one["text"] for one in charts.report["findings"])
    inner = np.s_[3:-3, 3:-3]
    assert np.abs(charts.image[inner].astype(float) - whole.image[inner]).max() < CODES


def test_what_lies_between_the_charts_does_not_show(tmp_path):
    """Exporters leave it black, some to within a pixel of the charts; and the picture is no finer than the atlas."""
    vertices, faces, places = sheet()
    joined = atlas(vertices, faces, places)
    shape = joined.texture.shape[:2]
    covered = np.isfinite(rasterise(joined.texcoords, joined.faces, np.zeros((len(joined.texcoords), 1)), *shape))
    near = cv2.dilate(covered[..., 0].astype(np.uint8), np.ones((3, 3), np.uint8))
    write_obj(replace(joined, texture=np.where(near[..., None], joined.texture, 0)), tmp_path / "atlas.obj")
    write_obj(SurfaceMesh(vertices, faces, places, picture()), tmp_path / "whole.obj")
    charts, whole = (restore(load_scan(tmp_path / f"{name}.obj"), Settings(dpi=80)) for name in ("atlas", "whole"))
    inner = np.s_[3:-3, 3:-3]
    assert np.abs(charts.image[inner].astype(float) - whole.image[inner]).max() < BY_A_SEAM
    assert charts.report["sampling_ppi"] == pytest.approx(whole.report["sampling_ppi"], rel=0.01)


def test_a_tube_stays_cut_open_at_its_seam():
    vertices, faces, places = sheet(WIDTH / (2 * np.pi))
    columns = np.arange(len(vertices)) % COLS
    vertices[columns == COLS - 1] = vertices[columns == 0]
    mesh = SurfaceMesh(vertices, faces, places, picture())
    assert without_seams(mesh) is mesh


def test_vertices_repeated_for_every_triangle_are_not_a_seam():
    vertices, faces, places = sheet()
    every = faces.ravel()
    mesh = SurfaceMesh(vertices[every], np.arange(len(every)).reshape(-1, 3), places[every], picture())
    assert without_seams(mesh) is mesh
    bare = SurfaceMesh(vertices, faces)
    assert without_seams(bare) is bare
