"""A range sensor alone, without the colour exposure, for tests that shoot many times."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.optics import RayHits, exact_pitch, measure_pitch, trace_rays
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.scene import Pose, Scene, Table, place_sheet
from drivers.simulated.scene.sheets import Sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES, MODES
from drivers.vivid900.geometry.triangulation import lines_of_sight, points_of


@dataclass(frozen=True, eq=False)
class RangeShot:
    scene: Scene
    hits: RayHits
    sight: np.ndarray
    exact: np.ndarray
    points: np.ndarray

    @property
    def measured(self) -> np.ndarray:
        return np.isfinite(self.points[..., 2])

    @property
    def on_page(self) -> np.ndarray:
        return np.isfinite(self.hits.flat[..., 0])


@pytest.fixture(scope="session")
def range_shot() -> Callable[..., RangeShot]:
    def shoot(
        sheet: Sheet,
        artwork: Artwork,
        *,
        lens: str = "MIDDLE",
        distance: float = 900.0,
        focus: float | None = None,
        mode: str = "fine",
        pose: Pose | None = None,
        table: Table = "dark",
        gap: float = 3.0,
        page: tuple[float, float] = (280.0, 200.0),
        exposure: float = 1.0,
        seed: int = 0,
    ) -> RangeShot:
        optics, focus = LENSES[lens], focus or distance
        scene = place_sheet(
            sheet, printed(artwork, page), depth_mm=distance + optics.pupil_mm, pose=pose, table=table, gap_mm=gap
        )
        body, sweep = nominal(optics), MODES[mode]
        caster = RayCaster(scene.vertices, scene.faces)
        hits = trace_rays(scene, caster, FaceMaps.of(scene), body, sweep, focus + optics.pupil_mm)
        exact = points_of(exact_pitch(hits, body, sweep, focus), body, sweep, focus)
        pitch = measure_pitch(hits, body, sweep, focus, np.random.default_rng(seed), exposure)
        sight = lines_of_sight(body, sweep).tangents
        return RangeShot(scene, hits, sight, exact, points_of(pitch, body, sweep, focus))

    return shoot
