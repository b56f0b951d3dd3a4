"""Range images of a simulated rig: true depths, and clear refusals."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from drivers.simulated import Text, Wave
from oracles.simulation.projector import RigPlan, build_rig
from oracles.structured_light import captured, depth_errors, greys, rig_of
from restore import Settings, restore
from restore.errors import BadInput, NotEnoughSurface
from restore.structured_light import Lens, Projector, scan_captures
from tests.restore.structured_light.conftest import PAGE_MM, PLAN

# A pixel of the projector is 0.8 mm wide, seen at 20°: 2.3 mm of depth. Edges known to a fiftieth of one.
DEPTH_MM = 0.05
FAR_MM = 0.5  # 99 %: beside steps and ink
SIZE_MM = 1.6  # at each side: two samples of 0.8 mm, the blurred rim of the page


@cache
def build(plan):
    return build_rig(Wave(wavelength_mm=90.0), Text(sizes_pt=(10.0,), columns=1, seed=8), plan, page_mm=PAGE_MM)


@cache
def scan_of(plan):
    pictures = captured(build(plan), seed=6)
    return scan_captures(greys(pictures), pictures[-2], rig_of(build(plan)))


class RigContract:
    """What the range image of any rig must be. `plan` is the rig's."""

    plan: RigPlan

    @pytest.fixture
    def rigged(self):
        return build(self.plan)

    @pytest.fixture
    def scan(self):
        return scan_of(self.plan)

    def test_samples_lie_on_the_surface(self, rigged, scan):
        error, places = depth_errors(scan, rigged)
        on_page = np.abs(error[np.isfinite(places[:, 0])])
        assert np.median(on_page) < DEPTH_MM
        assert np.quantile(on_page, 0.99) < FAR_MM

    def test_most_of_the_page_is_measured(self, rigged, scan):
        _, places = depth_errors(scan, rigged)
        inside = places[np.isfinite(places[:, 0])]
        assert (np.ptp(inside, axis=0) > np.array(PAGE_MM) - 2 * SIZE_MM).all()

    def test_the_grid_is_organised_and_its_texture_the_white_picture(self, rigged, scan):
        rows, cols = scan.points.shape[:2]
        assert scan.texture_xy.shape == (rows, cols, 2)
        seen = scan.points[scan.measured] * [1.0, -1.0, -1.0]
        pixels = rigged.camera.project(seen @ rigged.camera.axes + rigged.camera.position)
        np.testing.assert_allclose(pixels, scan.texture_xy[scan.measured], atol=1e-3)

    def test_the_page_comes_out_in_its_size(self, scan):
        page = restore(scan, Settings(points=300, dpi=75))
        np.testing.assert_allclose(page.report["page_mm"], PAGE_MM, atol=2 * SIZE_MM)


class TestProjectorNextToCamera(RigContract):
    plan = PLAN


class TestProjectorAbove(RigContract):
    plan = replace(PLAN, projector_deg=90.0)


class TestBrightRoom(RigContract):
    plan = replace(PLAN, ambient=0.4, exposure=0.5, noise=3.0)


def scanned(pictures, rig):
    return scan_captures(greys(pictures), pictures[-2], rig)


def test_another_number_of_pictures_is_refused(simulated, pictures):
    with pytest.raises(BadInput, match="37 images: the patterns of a projector of 512 × 320 pixels are 38") as fault:
        scanned(pictures[1:], rig_of(simulated))
    assert fault.value.exit_code == 3


def test_a_calibration_of_another_size_is_refused(simulated, pictures):
    with pytest.raises(BadInput, match="of 1600 × 1200, these have 640 × 480"):
        scanned(pictures, replace(rig_of(simulated), size=(1600, 1200)))
    rig = rig_of(simulated)
    large = Lens(rig.camera.matrix * [[4], [4], [1]], rig.camera.distortion)
    with pytest.raises(BadInput, match="principal point"):
        scanned(pictures, replace(rig, camera=large, size=None))


def test_a_calibration_of_another_rig_is_refused(simulated, pictures):
    rig = rig_of(simulated)
    with pytest.raises(BadInput, match="calibration does not fit"):
        scanned(pictures, replace(rig, shift=rig.shift + [0.0, 40.0, 0.0]))


def test_patterns_of_another_projector_are_refused(simulated, pictures):
    with pytest.raises(BadInput, match="1280 × 800 pixels are 44"):
        scanned(pictures, replace(rig_of(simulated), projector=Projector(1280, 800)))


def test_dark_pictures_are_too_little_surface(simulated, pictures):
    dark = [(picture // 200).astype(np.uint8) for picture in pictures]
    with pytest.raises(NotEnoughSurface, match="can be read at") as fault:
        scanned(dark, rig_of(simulated))
    assert fault.value.exit_code == 5
    assert "darken the room" in fault.value.hint


def test_black_before_white_is_refused(simulated, pictures):
    with pytest.raises(BadInput, match="brighter"):
        scanned([*pictures[:-2], pictures[-1], pictures[-2]], rig_of(simulated))


def test_pictures_out_of_order_are_refused(simulated, pictures):
    order = np.random.default_rng(1).permutation(len(pictures) - 2)
    with pytest.raises((BadInput, NotEnoughSurface)):
        scanned([*(pictures[k] for k in order), *pictures[-2:]], rig_of(simulated))


def test_overexposed_pictures_are_warned_of(simulated, pictures):
    bright = [np.clip(picture.astype(int) * 2, 0, 255).astype(np.uint8) for picture in pictures]
    scan = scanned(bright, rig_of(simulated))
    assert "overexposed" in scan.findings[0].text
    assert scanned(pictures, rig_of(simulated)).findings == ()
