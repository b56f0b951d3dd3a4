"""A camera photographs the scene where its lens says."""

import cv2
import numpy as np

from drivers.simulated import Curl, Flat, Markers, White
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.scene import place_sheet
from oracles.simulation.camera import Exposure, look_at, photograph_scene

SIGHT_PX = 0.01  # single-precision lines of sight over a focal length of a thousand pixels
MARKER_PX = 0.1  # of a marker's middle: blur in linear light draws the corners of black on white inwards all alike
EVEN = 1.0  # codes
GLARE = 80.0  # codes: three times the light
PAGE_MM = (200.0, 150.0)
MIDDLE = np.array([0.0, 0.0, -900.0])


def camera(**changes):
    options = {
        "size": (1000, 750), "focal_px": 1300.0, "roll_deg": 10.0, "offset": (8.0, -5.0),
        "radial": (-0.15, 0.1, -0.02), "tangential": (0.002, -0.001),
    } | changes  # fmt: skip
    return look_at(MIDDLE, np.array([100.0, -80.0, -500.0]), **options)


def test_projection_is_that_of_opencv():
    lens, points = camera(), MIDDLE + np.random.default_rng(0).uniform(-80, 80, (50, 3))
    matrix = np.array([[lens.focal_px, 0, lens.centre[0]], [0, lens.focal_px, lens.centre[1]], [0, 0, 1]])
    k1, k2, k3 = lens.radial
    turn, _ = cv2.Rodrigues(lens.axes)
    expected, _ = cv2.projectPoints(
        points, turn, -lens.axes @ lens.position, matrix, np.array([k1, k2, *lens.tangential, k3])
    )
    np.testing.assert_allclose(lens.project(points), expected[:, 0], atol=1e-9)


def test_lines_of_sight_lead_back_to_their_pixels():
    lens = camera()
    sight = lens.directions(300, 310).astype(float)
    back = lens.project(lens.position + 400 * sight)
    np.testing.assert_allclose(back[..., 0], np.tile(np.arange(1000.0), (10, 1)), atol=SIGHT_PX)
    np.testing.assert_allclose(back[..., 1], np.tile(np.arange(300.0, 310.0)[:, None], (1, 1000)), atol=SIGHT_PX)


def test_markers_are_seen_where_they_lie():
    scene, lens = place_sheet(Curl(), printed(Markers(), PAGE_MM), depth_mm=900.0), camera()
    grey = cv2.cvtColor(photograph_scene(scene, lens, Exposure(), np.random.default_rng(1)), cv2.COLOR_RGB2GRAY)
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(grey)
    assert len(ids) > 0.8 * len(scene.printed.markers)
    exact = np.stack([lens.project(scene.surface(scene.printed.markers[int(i)])) for i in ids.ravel()])
    off = (np.concatenate(corners) - exact).mean(axis=1)
    assert np.sqrt(np.mean(off**2)) < MARKER_PX


def test_light_and_gloss():
    plain, glossy = (
        place_sheet(Flat(), printed(White(gloss=gloss), PAGE_MM), depth_mm=900.0, table="none") for gloss in (0.0, 1.0)
    )
    above = look_at(MIDDLE, np.zeros(3) + [0, 0, -300.0], size=(200, 150), focal_px=900.0)
    calm = Exposure(lamp=np.array([0.0, 0.0, 1.0]), colour=(1.0, 0.5, 0.25), falloff=0.0, noise=0.0, blur_px=0.0)
    matte, mirror = (
        photograph_scene(scene, above, calm, np.random.default_rng(0)).astype(float) for scene in (plain, glossy)
    )
    red, green, blue = matte[75, 100]
    assert red > green > blue
    assert np.ptp(matte[70:80, 90:110, 0]) <= EVEN
    assert mirror[75, 100, 0] == 255  # the lamp stands behind the camera, and the paper mirrors it
    assert (mirror[75, 100] > matte[75, 100] + GLARE)[1:].all()
