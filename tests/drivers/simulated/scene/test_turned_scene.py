"""A scene on a turntable: it turns rigidly about the axle, and the scanner sees it as the stage stands."""

import numpy as np
import pytest

from drivers.simulated import Spread, White, rig
from drivers.simulated.scene.scene import Axle, place_sheet
from drivers.vivid900.geometry.lenses import FAST

ROUNDING_MM = 1e-9
AXLE = Axle((5.0, -4.0, -910.0), (0.1, 2.0, 0.3))
CORNERS = np.array([[0.0, 0.0], [200.0, 0.0], [200.0, 150.0], [0.0, 150.0]])


@pytest.fixture(scope="module")
def scene():
    return place_sheet(Spread(), White().print_on((200.0, 150.0)), depth_mm=920.0)


def test_a_full_turn_brings_everything_back(scene) -> None:
    once = scene.turned(250.0, AXLE).turned(110.0, AXLE)
    np.testing.assert_allclose(once.vertices, scene.vertices, atol=1e-6)  # the table reaches 3 m out
    np.testing.assert_allclose(once.surface(CORNERS), scene.surface(CORNERS), atol=ROUNDING_MM)


def test_mesh_and_exact_surface_turn_together(scene) -> None:
    turned = scene.turned(33.0, AXLE)
    page = np.unique(turned.faces[turned.on_page])
    np.testing.assert_allclose(turned.surface(turned.page_uv[page]), turned.vertices[page], atol=ROUNDING_MM)


def test_what_lies_on_the_axle_stays_and_the_rest_goes_counter_clockwise() -> None:
    rotation, shift = Axle((0.0, 0.0, -900.0), (0.0, 3.0, 0.0)).motion(90.0)
    np.testing.assert_allclose(rotation @ [0, 7, -900] + shift, [0, 7, -900], atol=ROUNDING_MM)
    # Seen from above, from where Y points: what was to the right goes to the back.
    np.testing.assert_allclose(rotation @ [10, 0, -900] + shift, [0, 0, -910], atol=ROUNDING_MM)


def test_the_sensor_looks_when_it_is_asked() -> None:
    stands = [0.0]
    axle = {"point_mm": [0.0, 0.0, -921.5], "direction": [0.0, 0.0, 1.0]}
    config = {"driver": "simulated", "scene": {"sheet": "flat", "artwork": "white", "axle": axle}}
    sensor = rig(config, angle=lambda: stands[0]).sensor
    before = sensor.truth(FAST).surface(CORNERS)
    stands[0] = 90.0
    after = sensor.truth(FAST).surface(CORNERS)
    np.testing.assert_allclose(after[:, 0], -before[:, 1], atol=ROUNDING_MM)
    np.testing.assert_allclose(after[:, 1], before[:, 0], atol=ROUNDING_MM)
