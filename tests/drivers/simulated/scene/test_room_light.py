"""The light on a simulated scene: distance, angle and shadow."""

import numpy as np
import pytest

from drivers.simulated import Flat, Spread, White
from drivers.simulated.imaging.colour import EXPOSURE, photograph
from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.albedo import linear
from drivers.simulated.scene.artwork.printed import PAPER
from drivers.simulated.scene.light import FAR_MM, Lamp, Light
from drivers.simulated.scene.scene import place_sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES

PAGE = (280.0, 200.0)
LENS = LENSES["MIDDLE"]
BODY = nominal(LENS)
DEPTH = 900 + LENS.pupil_mm
CODE = 0.012  # relative: half a code of a hundred in light


def light_on(sheet, light, *, shaded=True):
    """(480, 640, 3) the light on white paper."""
    scene = place_sheet(sheet, printed(White(), PAGE), depth_mm=DEPTH, table="none", light=light)
    caster, maps = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene)
    image = photograph(scene, caster, maps, BODY, np.random.default_rng(0), noise=False, shaded=shaded)
    return linear(image.astype(np.float32)) / (linear(np.array(PAPER, np.float32)) * EXPOSURE)


def test_a_near_lamp_follows_lamberts_law():
    lamp = Lamp((-300.0, 0.0, -400.0), share=0.8)
    seen = light_on(Flat(), Light((lamp,), ambient=0.0))[240, 60:580:40, 0]
    x = (np.arange(60, 580, 40) - 319.5) / LENS.focal_px * DEPTH
    way = np.stack([-300.0 - x, np.full_like(x, -0.24), np.full_like(x, DEPTH - 400.0)], axis=1)
    law = way[:, 2] / np.linalg.norm(way, axis=1) ** 3
    straight = (DEPTH - 400.0) / np.hypot(300.0, DEPTH - 400.0) ** 3
    np.testing.assert_allclose(
        seen, np.minimum(0.8 * law / straight, 1 / linear(np.float32([PAPER[0]])) / EXPOSURE), rtol=CODE
    )


def test_coloured_lamps_and_room_add_up():
    far = Lamp((0.0, 0.0, FAR_MM), share=0.5, colour=(1.0, 0.8, 0.4))
    light = Light((far,), ambient=0.3, ambient_colour=(0.5, 0.7, 1.0))
    expected = 0.5 * np.array([1.0, 0.8, 0.4]) + 0.3 * np.array([0.5, 0.7, 1.0])
    np.testing.assert_allclose(light_on(Flat(), light)[240, 320], expected, rtol=CODE)
    np.testing.assert_allclose(light_on(Spread(), light, shaded=False)[240, 100], expected, rtol=CODE)
    np.testing.assert_allclose(light.level, expected)


@pytest.mark.slow
def test_a_wall_throws_its_shadow_and_hollows_are_dim():
    low = Lamp((-FAR_MM, 0.0, 0.6 * FAR_MM), share=0.3)
    book, spine = Spread(slope_deg=66.0), 320
    shadowed, bare = (light_on(book, Light((low,), ambient=0.3, shadows=s))[240, :, 0] for s in (True, False))
    assert bare[spine + 2] > 0.8  # the wall that faces the lamp …
    assert shadowed[spine + 2] < 0.3  # … behind the other one
    assert shadowed[spine + 10] > 0.8 * bare[spine + 10]  # above its shadow
    assert shadowed[spine - 3] < 0.8 * bare[spine - 3]  # no lamp shines there, and half of the room is hidden
    assert shadowed[120] == pytest.approx(bare[120], rel=0.03)  # far from the gutter the page is open to all sides


@pytest.mark.slow
def test_a_large_lamp_has_a_half_shadow():
    book = Spread(slope_deg=66.0)
    at = (-500.0, 0.0, -750.0)
    sharp, soft = (
        light_on(book, Light((Lamp(at, 0.3, radius_mm=r),), ambient=0.3, shadows=True))[240, 322:360, 0]
        for r in (0.0, 60.0)
    )
    assert np.abs(np.diff(soft)).max() < 0.6 * np.abs(np.diff(sharp)).max()
