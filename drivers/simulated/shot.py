"""One shot of the simulated scanner, with the truth about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from drivers.simulated.artwork import Artwork, Markers, Print, Word
from drivers.simulated.colour import photograph
from drivers.simulated.facemaps import FaceMaps
from drivers.simulated.light import Light
from drivers.simulated.optics import expose, ideal, look
from drivers.simulated.raycast import RayCaster
from drivers.simulated.scene import Pose, Scene, Surface, Table, lay
from drivers.simulated.sheets import PageSize, Sheet
from drivers.vivid900.lenses import LENSES, MODES, Lens, Mode, tangents, texture_grid, triangulate
from restore.scan import Floats, RangeScan


@dataclass(frozen=True, eq=False)
class Truth:
    """What a perfect restoration of the shot would find.

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
        """id → (4, 2) mm corners on the page: upper left, upper right, lower right, lower left."""
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
) -> tuple[RangeScan, Truth]:
    """Print a page (markers unless told otherwise), warp it, lay it down, focus on its middle and shoot."""
    optics = LENSES[lens]
    scene = lay(
        sheet,
        printed(artwork or Markers(), page_mm),
        depth_mm=distance_mm + optics.pupil_mm,
        pose=pose,
        table=table,
        light=light,
    )
    return shoot_scene(
        scene, optics, MODES[mode], distance_mm, np.random.default_rng(seed), noise=noise, provenance={"seed": seed}
    )


@lru_cache(maxsize=8)  # 23 MB a page: enough for all kinds of artwork
def printed(artwork: Artwork, page_mm: PageSize) -> Print:
    """The artwork printed on a page; kept, since the same page is shot many times."""
    return artwork.print_on(page_mm)


def shoot_scene(
    scene: Scene,
    lens: Lens,
    mode: Mode,
    distance_mm: float,
    rng: np.random.Generator,
    *,
    exposure: float = 1.0,
    noise: bool = True,
    provenance: Mapping[str, Any] | None = None,
) -> tuple[RangeScan, Truth]:
    """One shot of a scene as it lies, focused at a distance from the front of the lens.

    exposure    laser power and gain against what automatic exposure would choose.
    noise       False for exact points wherever laser and lens see the surface within the window, and a colour image
                without blur or noise.
    provenance  anything to be noted besides the optics.
    """
    caster, maps = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene)
    texture_xy = texture_grid(mode)
    sight = tangents(lens, texture_xy)
    sighting = look(scene, caster, maps, sight, distance_mm + lens.pupil_mm)
    stripe = (
        expose(sighting, lens, mode, distance_mm, rng, exposure) if noise else ideal(sighting, lens, mode, distance_mm)
    )
    scan = RangeScan(
        points=triangulate(sight, stripe),
        texture=photograph(scene, caster, maps, lens, rng, noise=noise),
        texture_xy=texture_xy,
        provenance={
            "device": "simulated Vivid 900",
            "lens": lens.name,
            "distance_mm": distance_mm,
            "mode": mode.name,
            **(provenance or {}),
        },
    )
    return scan, Truth(scene.printed.page_mm, scene.printed, sighting.flat, sighting.points, scene.surface)
