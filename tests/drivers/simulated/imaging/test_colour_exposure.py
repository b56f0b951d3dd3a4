"""The colour exposure: where things are, and how bright."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from drivers.simulated import Binding, Figure, Flat, Markers, Miura, Spread, Text, Wave, White, shoot
from drivers.simulated.imaging.colour import EXPOSURE, NOISE_CODES, photograph
from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.albedo import linear, srgb
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.artwork.printed import MM_PER_PIXEL, PAPER
from drivers.simulated.scene.scene import Table, place_sheet
from drivers.simulated.scene.sheets import Sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES
from drivers.vivid900.geometry.triangulation import project
from restore.scan import Bytes

pytestmark = pytest.mark.slow

PAGE = (280.0, 200.0)
MIDDLE = nominal(LENSES["MIDDLE"])
EDGE_PX = 0.1  # rms: nine rays a pixel place an edge to 1/3 pixel / √12 = 0.1, less for slanting edges
EDGE_BIAS_PX = 0.03  # and on the average over hundreds of edges to a fraction of that
INK = 0.02  # relative: eight-bit codes, half a code in thirty
BENT_PX = 0.1  # edges that bend more, over a crease say, have no one direction to measure across
CENTRE_PX = 0.1  # mean over all markers of corners found to whole pixels, a uniform error of 0.3 px each


@pytest.fixture(scope="module")
def picture() -> Callable[..., Bytes]:
    def take(sheet: Sheet, artwork: Artwork, *, table: Table = "dark", seed: int = 0, noise: bool = True) -> Bytes:
        scene = place_sheet(sheet, printed(artwork, PAGE), depth_mm=900 + MIDDLE.pupil_mm, table=table)
        caster, maps = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene)
        return photograph(scene, caster, maps, MIDDLE, np.random.default_rng(seed), noise=noise)

    return take


def edge_offsets(image: Bytes, middles: np.ndarray) -> np.ndarray:
    """Where, in px outward (m, 4), the picture passes half-way from ink to paper at the edges of dark squares, given by
    the middles (m, 4, 2) px of the edges."""
    outward = middles - middles.mean(axis=1, keepdims=True)
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    reach = np.linspace(-2.5, 2.5, 101)
    x, y = np.moveaxis(middles[..., None, :] + outward[..., None, :] * reach[:, None], -1, 0).astype(np.float32)
    green = np.ascontiguousarray(image[..., 1])
    profile = cv2.remap(green, x.reshape(-1, 101), y.reshape(-1, 101), cv2.INTER_LINEAR).astype(float)
    half = (profile[:, :20].mean(axis=1) + profile[:, -20:].mean(axis=1)) / 2
    return reach[np.argmax(profile > half[:, None], axis=1)].reshape(middles.shape[:2])


@pytest.mark.parametrize("sheet", [Flat(), Binding(slope_deg=40.0), Miura()], ids=lambda sheet: sheet.name)
def test_ink_is_seen_where_the_truth_projects_to(sheet: Sheet) -> None:
    scan, truth = shoot(sheet, Markers(), seed=2, mode="fast")
    corners = np.array(list(truth.markers.values()))
    middles, there = (corners + np.roll(corners, -1, axis=1)) / 2, np.roll(corners, -1, axis=1)
    here, edge, there = (project(MIDDLE, truth.surface(page_uv)) for page_uv in (corners, middles, there))
    straight = np.linalg.norm((here + there) / 2 - edge, axis=2) < BENT_PX
    offsets = edge_offsets(scan.texture, edge)[straight]
    assert straight.sum() > 100
    assert abs(np.mean(offsets)) < EDGE_BIAS_PX
    assert np.sqrt(np.mean(offsets**2)) < EDGE_PX


def test_markers_are_found_and_not_displaced() -> None:
    scan, truth = shoot(Wave(), Markers(), seed=2, mode="fast")
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250))
    corners, ids, _ = detector.detectMarkers(cv2.cvtColor(scan.texture, cv2.COLOR_RGB2GRAY))
    assert len(ids) > 0.95 * len(truth.markers)
    seen = project(MIDDLE, truth.surface(np.array([truth.markers[int(i)] for i in ids.ravel()])))
    off = np.concatenate(corners).mean(axis=1) - seen.mean(axis=1)
    assert np.abs(off.mean(axis=0)).max() < CENTRE_PX


def test_colour_and_range_show_the_same_place() -> None:
    scan, truth = shoot(Flat(), Figure(), noise=False, table="none")
    box = np.array(truth.printed.patches["red"])
    inside = (truth.flat > box[:2] + 1).all(axis=2) & (truth.flat < box[2:] - 1).all(axis=2)
    x, y = np.rint(scan.texture_xy[inside]).astype(int).T
    colour = scan.texture[y, x].astype(int)
    assert inside.sum() > 2000
    assert (colour[:, 0] - colour[:, 1:].max(axis=1)).min() > 50


def test_every_pixel_is_the_mean_over_its_area(picture: Callable[..., Bytes]) -> None:
    # Letters finer than a pixel darken it by just their share of ink, wherever they fall.
    text = Text(title_pt=6, sizes_pt=(6,))
    codes = picture(Flat(), text, noise=False)[150:330, 200:440, 1].astype(np.float32)
    page = printed(text, PAGE).image[..., 1].astype(np.float32)
    step = (900 + MIDDLE.pupil_mm) / MIDDLE.focal_px / MM_PER_PIXEL  # pixels of the print to one of the picture
    rows, cols = (
        slice(*np.rint(n / 2 + step * reach * np.array([-1, 1])).astype(int))
        for n, reach in zip(page.shape, (90, 120), strict=True)
    )
    seen = srgb(linear(codes) / EXPOSURE).mean()
    assert PAPER[1] - seen == pytest.approx(PAPER[1] - page[rows, cols].mean(), rel=INK)


def test_brightness_of_paper_void_and_tables(picture: Callable[..., Bytes]) -> None:
    level = {
        table: picture(Flat(), White(), table=table, noise=False).astype(int)
        for table in ("none", "dark", "light", "white")
    }
    assert level["none"][240, 320, 0] == pytest.approx(226, abs=2)
    assert level["none"][5, 5].max() < 40
    for table, low, high in (("dark", 50, 95), ("light", 140, 210), ("white", 200, 226)):
        board = level[table][:15]
        assert low < board[..., 0].mean() < high
        assert (board[..., 0] > board[..., 2]).all()  # all boards are warm


def test_walls_are_shaded_by_their_slope(picture: Callable[..., Bytes]) -> None:
    page = picture(Spread(), White(), noise=False)[240, :, 0].astype(int)
    spine = 320
    assert page[spine + 12] - page[spine - 12] > 40  # the lamp stands on the left: it lights the wall on the right
    assert abs(page[spine + 150] - page[spine - 150]) < 5


def test_the_sensor_is_noisy_and_repeats_with_its_seed(picture: Callable[..., Bytes]) -> None:
    first, again, other = (picture(Flat(), White(), table="none", seed=s) for s in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    difference = first[200:280, 200:440].astype(float) - other[200:280, 200:440]
    assert difference.std() == pytest.approx(NOISE_CODES * np.sqrt(2), rel=0.05)


def test_size_is_the_same_in_every_mode() -> None:
    for mode, size in (("fine", (480, 640, 3)), ("fast", (240, 320, 3))):
        scan, truth = shoot(Flat(), White(), mode=mode)
        assert scan.points.shape == truth.points.shape == size
        assert truth.flat.shape == scan.texture_xy.shape == (*size[:2], 2)
        assert scan.texture.shape == (480, 640, 3)
        assert scan.texture.dtype == np.uint8
