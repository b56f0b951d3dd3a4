"""Views of one page on a simulated turntable, whose axis is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from drivers.simulated import Flat, Pose, Spread, Text, Truth
from drivers.simulated.imaging.shot import printed, shoot_scene
from drivers.simulated.scene.artwork import Artwork, Markers
from drivers.simulated.scene.scene import Axle, place_sheet
from drivers.simulated.scene.sheets import Sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES, MODES
from restore.scan import RangeScan
from restore.turntable import RotationAxis

DISTANCE_MM, PAGE_MM = 900.0, (170.0, 140.0)  # near enough for the depth window of FAST
AXLE = Axle((8.0, -5.0, -915.0), (0.03, 0.05, 1.0))  # about the line of sight, as it never quite is


@dataclass(frozen=True, eq=False)
class Turned:
    scans: Sequence[RangeScan]
    truths: Sequence[Truth]
    turns: Sequence[float]
    axis: RotationAxis


def axis_of(axle: Axle) -> RotationAxis:
    direction = np.asarray(axle.direction)
    return RotationAxis(np.asarray(axle.point_mm), direction / np.linalg.norm(direction))


def turned(sheet: Sheet, artwork: Artwork, pose: Pose, turns: Sequence[float], *, axle: Axle = AXLE) -> Turned:
    lens = LENSES["MIDDLE"]
    page = printed(artwork, PAGE_MM)
    scene = place_sheet(sheet, page, depth_mm=DISTANCE_MM + lens.pupil_mm, pose=pose)
    shots = [
        shoot_scene(scene.turned(turn, axle), nominal(lens), MODES["fast"], DISTANCE_MM, np.random.default_rng(index))
        for index, turn in enumerate(turns)
    ]
    scans, truths = zip(*shots, strict=True)
    return Turned(scans, truths, turns, axis_of(axle))


@pytest.fixture(scope="session")
def book() -> Turned:
    """A book whose gutter lies across the laser: its lower wall is in the shadow, until it is turned round."""
    return turned(Spread(slope_deg=68.0, reach_mm=100.0), Text(), Pose(turn_deg=90, tilt_deg=14), (0.0, 180.0))


@pytest.fixture(scope="session")
def board() -> Turned:
    """A flat board with markers."""
    return turned(Flat(), Markers(), Pose(), (0.0, 90.0))
