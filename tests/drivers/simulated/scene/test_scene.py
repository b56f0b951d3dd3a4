"""Where the page and the table lie."""

import numpy as np
import pytest

from drivers.simulated import Flat, Pose, Spread, White
from drivers.simulated.scene.scene import Scene, place_sheet

PAGE = (280.0, 200.0)
MIDDLE, RIGHT, TOP = np.array([140.0, 100.0]), np.array([280.0, 100.0]), np.array([140.0, 200.0])
ROUNDING_MM = 1e-9


def laid(sheet=None, **options) -> Scene:
    return place_sheet(sheet or Flat(), White().print_on(PAGE), depth_mm=900.0, **options)


def test_a_page_lies_upright_on_the_axis() -> None:
    surface = laid().surface
    np.testing.assert_allclose(surface(MIDDLE), [0, 0, -900], atol=ROUNDING_MM)
    np.testing.assert_allclose(surface(RIGHT), [140, 0, -900], atol=ROUNDING_MM)
    np.testing.assert_allclose(surface(TOP), [0, 100, -900], atol=ROUNDING_MM)


def test_tilt_takes_the_upper_edge_away() -> None:
    surface = laid(pose=Pose(tilt_deg=30)).surface
    np.testing.assert_allclose(surface(TOP), [0, 100 * np.sqrt(3) / 2, -950], atol=ROUNDING_MM)
    np.testing.assert_allclose(surface(RIGHT), [140, 0, -900], atol=ROUNDING_MM)


def test_turn_is_counter_clockwise_and_comes_before_the_tilt() -> None:
    surface = laid(pose=Pose(turn_deg=90, tilt_deg=30)).surface
    np.testing.assert_allclose(surface(RIGHT), [0, 140 * np.sqrt(3) / 2, -970], atol=ROUNDING_MM)
    np.testing.assert_allclose(surface(TOP), [-100, 0, -900], atol=ROUNDING_MM)


def test_shift_is_right_up_and_nearer() -> None:
    np.testing.assert_allclose(laid(pose=Pose(shift_mm=(1, 2, 3))).surface(MIDDLE), [1, 2, -897], atol=ROUNDING_MM)


def test_a_deep_sheet_lies_about_its_middle_depth() -> None:
    scene = laid(Spread(), table="none")
    assert scene.on_page.all()
    np.testing.assert_allclose(
        (scene.vertices.min(axis=0) + scene.vertices.max(axis=0)) / 2, [0, 0, -900], atol=ROUNDING_MM
    )


@pytest.mark.parametrize("tilt", [0.0, 25.0])
def test_the_table_lies_below_the_lowest_point_and_tilts_with_the_page(tilt: float) -> None:
    scene = laid(Spread(), table="dark", gap_mm=5.0, pose=Pose(tilt_deg=tilt))
    board = scene.vertices[np.unique(scene.faces[~scene.on_page])]
    a, b, c = board[:3]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    above = (scene.vertices[np.unique(scene.faces[scene.on_page])] - a) @ normal
    assert above.min() == pytest.approx(5.0, abs=1e-6)


def test_mesh_and_exact_surface_agree() -> None:
    scene = laid(Spread(), pose=Pose(tilt_deg=10, turn_deg=-20, shift_mm=(5, 6, 7)))
    page = np.unique(scene.faces[scene.on_page])
    np.testing.assert_allclose(scene.surface(scene.page_uv[page]), scene.vertices[page], atol=ROUNDING_MM)
