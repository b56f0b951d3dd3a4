"""Pages before the scanner and before another camera: scan, photographs, and the exact projection of both."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from drivers.simulated import Binding, Crumpled, Curl, Figure, Miura, Pose, Spread, Text, Wave
from drivers.simulated.imaging.shot import Truth, printed, shoot_scene
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.scene import Scene, place_sheet
from drivers.simulated.scene.sheets import Sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES, MODES
from oracles.simulation.camera import Camera, Exposure, look_at, photograph_scene
from restore import FlatMesh, RangeScan, Settings
from restore.photo.reference import make_reference
from restore.photo.register import Registration
from restore.pipeline import Stopwatch
from restore.prepared.prepare import prepare
from restore.scan import Bytes, Floats

A4 = (297.0, 210.0)
DISTANCE_MM, LENS = 900.0, LENSES["MIDDLE"]
PAGE = np.array([0.0, 0.0, -DISTANCE_MM - LENS.pupil_mm])  # the middle of the page
SEED = 3
SHEETS: dict[str, Sheet] = {
    "curl": Curl(),
    "wave": Wave(),
    "binding": Binding(),
    "Miura fold": Miura(),
    "deep gutter": Spread(slope_deg=66.0),
    "crumpled": Crumpled(),
}
ARTWORK: dict[str, Artwork] = {"text": Text(), "figure": Figure()}
LIMIT_PX = 1.5  # rms reprojection error that a registration may have


@dataclass(frozen=True)
class View:
    """The place of a camera from the middle of the page, mm right, up and towards the scanner, and its roll.

    focal: in widths of the picture; k1, k2: radial distortion.
    """

    place: tuple[float, float, float]
    focal: float
    roll_deg: float
    k1: float
    k2: float

    def camera(self, size: tuple[int, int], *, tangential: float = 0.001, offset: float = 0.004) -> Camera:
        """The camera for a size (w, h), its lens a little askew."""
        return look_at(
            PAGE, PAGE + self.place, size=size, focal_px=self.focal * size[0], roll_deg=self.roll_deg,
            offset=(offset * size[0], -0.75 * offset * size[0]), radial=(self.k1, self.k2, 0.0),
            tangential=(tangential, -0.7 * tangential),
        )  # fmt: skip


VIEWS = {
    "above": View((20.0, -30.0, 500.0), 1.45, 2.0, -0.12, 0.08),
    "from the left": View((-250.0, 60.0, 520.0), 1.45, -15.0, -0.12, 0.08),
    "phone, held upright": View((60.0, -200.0, 560.0), 1.2, 93.0, 0.05, -0.03),
    "long lens": View((150.0, 250.0, 1500.0), 4.0, 5.0, 0.1, 0.0),
}


@cache
def scan_page(sheet: Sheet, artwork: Artwork) -> tuple[Scene, RangeScan, Truth]:
    """The scene with a page before the scanner, its scan and the truth about it; made once."""
    depth = DISTANCE_MM + LENS.pupil_mm
    scene = place_sheet(sheet, printed(artwork, A4), depth_mm=depth, pose=Pose(tilt_deg=3.0))
    scan, truth = shoot_scene(scene, nominal(LENS), MODES["fine"], DISTANCE_MM, np.random.default_rng(SEED))
    return scene, scan, truth


@cache
def restored_mesh(sheet: Sheet, artwork: Artwork) -> FlatMesh:
    """The fine mesh of the restored page; made once."""
    return prepare(scan_page(sheet, artwork)[1]).unroll(Settings(), Stopwatch(None)).fine


def take_photograph(scene: Scene, camera: Camera, *, seed: int = SEED, exposure: Exposure | None = None) -> Bytes:
    """(h, w, 3) photograph of the scene through a camera, by the light of a window if no exposure is given."""
    return photograph_scene(scene, camera, exposure or Exposure(), np.random.default_rng(seed))


def reprojection_errors(page: FlatMesh, truth: Truth, camera: Camera, found: Registration) -> Floats:
    """(n,) pixels between where the scanner's lines of sight lie in the photograph and where the registration says.

    For every pixel of the scanner's image that shows the page: the exact surface point through the exact camera, and
    the measured surface point through the camera that was found.
    """
    reference = make_reference(page)
    registered = found.camera.project(reference.points.reshape(-1, 3).astype(float)).reshape(*reference.page.shape, 2)
    exact = camera.project(truth.points)
    on_page = np.isfinite(truth.flat[..., 0]) & reference.page
    within = ((exact >= 0) & (exact <= np.array(camera.size) - 1)).all(axis=2)
    distance = np.linalg.norm(registered - exact, axis=2)[on_page & within]
    return np.asarray(distance[np.isfinite(distance)])
