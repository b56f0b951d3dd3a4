"""One shot of the simulated scanner, with its ground truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from drivers.simulated.imaging.colour import photograph
from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.optics import RayHits, exact_pitch, measure_pitch, trace_rays
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.scene.artwork import Artwork, Markers, Print, Word
from drivers.simulated.scene.light import Light
from drivers.simulated.scene.scene import Pose, Scene, Surface, Table, place_sheet
from drivers.simulated.scene.sheets import PageSize, Sheet
from drivers.vivid900.geometry.calibration import Calibration, nominal
from drivers.vivid900.geometry.lenses import LENSES, MODES, Mode, texture_grid
from drivers.vivid900.geometry.triangulation import points_of
from restore.scan import Bytes, Floats, RangeScan


@dataclass(frozen=True, eq=False)
class Truth:
    """Ground truth of a shot: the result of a perfect restoration.

    page_mm  width and height of the flat page.
    printed  what is printed on it: markers, words, patches in mm from its lower left corner.
    flat     (rows, cols, 2) mm on the flat page of what lies on each line of sight, NaN off the page.
    points   (rows, cols, 3) mm, exact and without shadows or window, NaN where a line of sight meets nothing.
    surface  maps (…, 2) mm on the page to (…, 3) mm in the scanner's frame.
    """

    page_mm: PageSize
    printed: Print
    flat: Floats
    points: Floats
    surface: Surface

    @property
    def markers(self) -> Mapping[int, Floats]:
        """Return id → corners (4, 2) mm on the page, clockwise from the upper left."""
        return self.printed.markers

    @property
    def words(self) -> tuple[Word, ...]:
        """The printed words in reading order."""
        return self.printed.words


def shoot(
    sheet: Sheet,
    artwork: Artwork | None = None,
    *,
    lens: str = "MIDDLE",
    distance_mm: float = 900.0,
    mode: Literal["fine", "fast"] = "fine",
    seed: int = 0,
    pose: Pose | None = None,
    table: Table = "dark",
    page_mm: PageSize = (280.0, 200.0),
    noise: bool = True,
    light: Light | None = None,
    body: Calibration | None = None,
    calibration: Calibration | None = None,
) -> tuple[RangeScan, Truth]:
    """Capture a printed page, warped, posed and in focus, with markers by default.

    body, calibration: as for `shoot_scene`; by default a body with the manual's figures. Returns the scan with its
    ground truth.
    """
    optics = LENSES[lens]
    scene = place_sheet(
        sheet,
        printed(artwork or Markers(), page_mm),
        depth_mm=distance_mm + optics.pupil_mm,
        pose=pose,
        table=table,
        light=light,
    )
    return shoot_scene(
        scene,
        body or nominal(optics),
        MODES[mode],
        distance_mm,
        np.random.default_rng(seed),
        noise=noise,
        calibration=calibration,
        provenance={"seed": seed},
    )


@lru_cache(maxsize=8)  # 23 MB a page: enough for all kinds of artwork
def printed(artwork: Artwork, page_mm: PageSize) -> Print:
    """The artwork printed on a page; kept, since the same page is shot many times."""
    return artwork.print_on(page_mm)


@dataclass(frozen=True, eq=False)
class Exposure:
    """Raw data of one shot.

    pitch     (rows, cols) frame at which the stripe crossed each sample, NaN where nothing was measured.
    texture   (480, 640, 3) uint8 RGB.
    sighting  intersections of the lines of sight with the scene.
    """

    pitch: Floats
    texture: Bytes
    hits: RayHits


def expose_scene(
    scene: Scene,
    body: Calibration,
    mode: Mode,
    distance_mm: float,
    rng: np.random.Generator,
    *,
    exposure: float = 1.0,
    noise: bool = True,
) -> Exposure:
    """One exposure of a scene, as `shoot_scene` takes it."""
    caster, maps = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene)
    hits = trace_rays(scene, caster, maps, body, mode, distance_mm + body.pupil_mm)
    pitch = (
        measure_pitch(hits, body, mode, distance_mm, rng, exposure)
        if noise
        else exact_pitch(hits, body, mode, distance_mm)
    )
    return Exposure(pitch, photograph(scene, caster, maps, body, rng, noise=noise), hits)


def shoot_scene(
    scene: Scene,
    body: Calibration,
    mode: Mode,
    distance_mm: float,
    rng: np.random.Generator,
    *,
    exposure: float = 1.0,
    noise: bool = True,
    calibration: Calibration | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> tuple[RangeScan, Truth]:
    """Capture a scene, focused at a distance from the front of the lens.

    body: true geometry of the body and its lens.
    exposure: laser power and gain against what automatic exposure would choose.
    noise: False for exact points wherever laser and lens see the surface within the window, and a colour image without
        blur or noise.
    calibration: the one that the driver uses; by default the true one.
    provenance: further entries in addition to the optics.
    Returns the scan with its ground truth.
    """
    taken = expose_scene(scene, body, mode, distance_mm, rng, exposure=exposure, noise=noise)
    calibration = calibration or body
    scan = RangeScan(
        points=points_of(taken.pitch, calibration, mode, distance_mm),
        texture=taken.texture,
        texture_xy=texture_grid(mode),
        provenance={
            "device": "simulated Vivid 900",
            "lens": body.lens,
            "distance_mm": distance_mm,
            "mode": mode.name,
            "calibration": calibration.as_json(),
            **(provenance or {}),
        },
    )
    hits = taken.hits
    return scan, Truth(scene.printed.page_mm, scene.printed, hits.flat, hits.points, scene.surface)
