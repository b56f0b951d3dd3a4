"""A bent sheet before the scanner's camera under many prints and lamps; what they share is computed once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.light_draws import Spot
from bench.light_prints import DPI
from bench.shading import DISTANCE_MM, PAGE_MM, measured_and_unrolled
from drivers.simulated.imaging.colour import BLUR_PX, EXPOSURE, NOISE_CODES
from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.illumination import (
    LIFT_MM,
    SKY_RAYS,
    irradiance,
    lamp_visibility,
    sky_direction,
    sky_view_factor,
)
from drivers.simulated.imaging.optics import LENS_CENTRE
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.scene.albedo import LINEAR, colour_codes, linear, srgb
from drivers.simulated.scene.artwork import Print, White
from drivers.simulated.scene.light import Light
from drivers.simulated.scene.scene import Scene, place_sheet
from drivers.simulated.scene.sheets import Sheet
from drivers.vivid900.geometry.calibration import Calibration, nominal
from drivers.vivid900.geometry.lenses import LENSES
from drivers.vivid900.geometry.triangulation import project, tangents
from restore.prepared.prepared import Prepared, Unrolled
from restore.scan import Bytes, Floats, Ints, Mask
from restore.shading.relief import Relief, relief_of
from restore.shading.remove import LIGHT_DPI, PageLight, find_light
from restore.texture.page import paint_page
from restore.vivid import TEXTURE_COLS, TEXTURE_ROWS

SUBSAMPLES = 2  # rays across and down a pixel
COARSE = 8  # rays: how much of the room and of the page is seen changes slowly
LENS = LENSES["MIDDLE"]

Field = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Stage:
    """A sheet as the camera sees it, ray by ray (h, w), and the same sheet as it was scanned and unrolled.

    face (h, w), −1 where a ray meets nothing; points (h, w, 3) mm. finer: pixels of the camera to one of the scanner's,
    across and down, 1 to SUBSAMPLES.
    """

    scene: Scene
    body: Calibration
    caster: RayCaster
    maps: FaceMaps
    face: Ints
    points: Floats
    surface: Prepared
    unrolled: Unrolled
    finer: int = 1

    @classmethod
    def of(cls, sheet: Sheet, *, finer: int = 1) -> Stage:
        """Scan white paper bent to a sheet, before a camera of (480, 640) · finer pixels."""
        surface, unrolled = measured_and_unrolled(sheet, White())
        scene = place_sheet(sheet, White().print_on(PAGE_MM), depth_mm=DISTANCE_MM + LENS.pupil_mm)
        caster, maps, body = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene), nominal(LENS)
        row, col = np.mgrid[: TEXTURE_ROWS * SUBSAMPLES, : TEXTURE_COLS * SUBSAMPLES]
        sight = tangents(body, (np.stack([col, row], axis=-1) + 0.5) / SUBSAMPLES - 0.5)
        rays = np.concatenate([sight, np.full((*sight.shape[:2], 1), -1.0)], axis=-1)
        face, depth = caster.first_hit(LENS_CENTRE, rays)
        points = rays * np.where(face >= 0, depth, 0)[..., None]
        return cls(scene, body, caster, maps, face, points, surface, unrolled, finer)

    def page(self, texture: Bytes, dpi: float) -> tuple[Bytes, Mask]:
        """The page (h, w, 3) painted from a picture of the camera, and where it is."""
        fine = self.unrolled.fine
        assert fine.texcoords is not None
        texcoords = (fine.texcoords + 0.5) * self.finer - 0.5
        painting = paint_page(replace(fine, texture=texture, texcoords=texcoords), dpi)
        return painting.image, painting.mask

    def find_light(self, texture: Bytes) -> PageLight:
        """The light of the page in a picture of the camera."""
        return find_light(*self.page(texture, LIGHT_DPI), self.relief)

    @cached_property
    def relief(self) -> Relief:
        """The shape of the page over the flat page."""
        return relief_of(self.unrolled.fine, self.surface.normals_on, LIGHT_DPI)

    def print(self, image: Bytes) -> Field:
        """(480, 640, 3) · finer: codes, 0 to 255, of a printed page (h, w, 3) as the camera's pixels average it."""
        scene = replace(self.scene, printed=Print(image, PAGE_MM, dpi=DPI))
        seen = self.face >= 0
        footprint = DISTANCE_MM / self.body.focal_px / SUBSAMPLES
        codes = np.zeros((*self.face.shape, 3), np.float32)
        face, points = self.face[seen], self.points[seen]
        codes[seen] = colour_codes(scene, footprint)(face, self.maps.page(face, points))
        return _averaged(codes, self.finer)

    def light(self, light: Light, albedo: Floats, spot: Spot | None) -> Field:
        """(480, 640, 3) · finer: light of lamps and room with their shadows, and once from the page to itself.

        albedo (3,): mean share of the light that the print gives back.
        """
        depth = -float(self.scene.surface.shift[2])
        seen = self.face >= 0
        parts = irradiance(light, self.maps, self.face[seen], self.points[seen], depth)
        if spot is not None:
            away = np.linalg.norm(self.points[seen][:, :2] - spot.middle_mm, axis=1) / spot.radius_mm
            parts[1] *= (spot.outside + (1 - spot.outside) / (1 + away**6))[:, None].astype(np.float32)
        total = np.zeros((*self.face.shape, 3), np.float32)
        if light.shadows:
            shares = [self._coarse(sky_view_factor(self.caster, *self._at(COARSE)), COARSE)]
            shares += [
                self._coarse(lamp_visibility(lamp, self.caster, *self._at(SUBSAMPLES)), SUBSAMPLES)
                for lamp in light.lamps
            ]
            parts = [part * share[seen][:, None] for part, share in zip(parts, shares, strict=True)]
        total[seen] = np.sum(parts, axis=0)
        if light.shadows:
            total[seen] += (albedo * self._reflected(total))[seen]
        return _averaged(total, self.finer)

    def _at(self, step: int) -> tuple[Floats, Floats]:
        face, points = self.face[::step, ::step], self.points[::step, ::step]
        seen = face >= 0
        return self.maps.facing(face[seen], points[seen]), points[seen]

    def _coarse(self, values: Floats, step: int) -> Field:
        """Values at every step-th ray that meets something, at all rays."""
        seen = self.face[::step, ::step] >= 0
        field = np.ones((*seen.shape, *values.shape[1:]), np.float32)
        field[seen] = values
        return np.asarray(cv2.resize(field, self.face.shape[::-1], interpolation=cv2.INTER_LINEAR))

    def _reflected(self, light: Field) -> Field:
        """(h, w, 3) what comes from the page to itself once, for paper that gives back all light."""
        normals, points = self._at(COARSE)
        start = points + LIFT_MM * normals
        gathered = np.zeros((len(points), 3), np.float32)
        for k in range(SKY_RAYS):
            way = sky_direction(normals, k)
            face, reach = self.caster.first_hits(start, way)
            met = (face >= 0) & self.scene.on_page[np.maximum(face, 0)]
            where = project(self.body, start[met] + reach[met, None] * way[met]) * SUBSAMPLES
            at = np.ascontiguousarray(where.astype(np.float32)).reshape(-1, 1, 2)
            gathered[met] += cv2.remap(light, at, None, cv2.INTER_LINEAR).reshape(-1, 3) if met.any() else 0
        return self._coarse(gathered / SKY_RAYS, COARSE)


def _averaged(field: Field, finer: int) -> Field:
    size = (TEXTURE_COLS * finer, TEXTURE_ROWS * finer)
    return np.asarray(cv2.GaussianBlur(cv2.resize(field, size, interpolation=cv2.INTER_AREA), (0, 0), BLUR_PX))


def picture(codes: Field, light: Field | Floats, rng: np.random.Generator | None = None) -> Bytes:
    """(h, w, 3) what the camera records of a print in some light, with the sensor's noise when rng is given."""
    out = srgb(linear(codes) * (EXPOSURE * light).astype(np.float32))
    if rng is not None:
        out = out + rng.normal(0, NOISE_CODES, out.shape)
    return np.clip(np.rint(out), 0, 255).astype(np.uint8)


def mean_albedo(image: Bytes) -> Floats:
    """(3,) mean share of the light that a print (h, w, 3) gives back."""
    return np.asarray(LINEAR[image[::8, ::8]].mean(axis=(0, 1)))
