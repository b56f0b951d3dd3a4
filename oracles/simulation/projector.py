"""A camera next to a projector that lights a printed, warped page with its patterns, with the exact truth about it.

The projector is a pinhole with distortion like the camera, run backwards. Its light falls off with the distance and the
angle of incidence, and not beyond what stands in its way; the light of the room comes on top. Camera and projector each
blur, the camera's sensor has noise.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.albedo import LINEAR, colour_codes, linear, srgb
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.scene import Scene, Table, place_sheet
from drivers.simulated.scene.sheets import PageSize, Sheet
from oracles.simulation.camera import Camera, look_at
from restore.scan import Bytes, Floats

SHADOW_MM = 0.05  # a lit point is met by the projector's light at its own distance within this: single-precision rays


@dataclass(frozen=True)
class RigPlan:
    """How camera and projector stand, and what light there is.

    size        width and height of the camera's picture.
    projector   width and height of the projector's.
    distance_mm of the camera from the middle of the page.
    baseline_mm from the camera to the projector.
    projector_deg  direction of the projector from the camera: 0 to the right, 90 above.
    view_mm     width that the camera sees at that distance; the projector lights a share LIT of it more.
    ambient     light of the room on white paper, as a share of the projector's white.
    exposure    white paper under the projector's white gives this share of full scale, linear.
    blur_px     standard deviation of the camera's blur.
    focus_px    standard deviation of the projector's blur, in its own pixels.
    noise       standard deviation of the sensor's noise in 8-bit codes.
    """

    size: tuple[int, int] = (1600, 1200)
    projector: tuple[int, int] = (1280, 800)
    distance_mm: float = 700.0
    baseline_mm: float = 250.0
    projector_deg: float = 0.0
    view_mm: float = 420.0
    ambient: float = 0.1
    exposure: float = 0.7
    blur_px: float = 0.7
    focus_px: float = 0.4
    noise: float = 2.0
    radial: tuple[float, float, float] = (0.06, -0.11, 0.05)
    tangential: tuple[float, float] = (4e-4, -3e-4)


LIT = 1.25  # width that the projector lights over that which the camera sees


@dataclass(frozen=True, eq=False)
class SimulatedRig:
    """A camera and a projector before a scene."""

    camera: Camera
    projector: Camera
    plan: RigPlan
    scene: Scene

    @property
    def rotation(self) -> Floats:
        """(3, 3) from the camera's frame to the projector's."""
        return self.projector.axes @ self.camera.axes.T

    @property
    def shift(self) -> Floats:
        """(3,) mm: the camera's centre in the projector's frame."""
        return self.projector.axes @ (self.camera.position - self.projector.position)

    def points(self, tangents: Floats) -> tuple[Floats, Floats]:
        """What lines of sight (n, 2) show: points (n, 3) mm in the camera's frame, and places (n, 2) mm on the page.

        Tangents are x right and y down of the camera. NaN where they meet nothing, places also next to the page.
        """
        rays = np.column_stack([tangents, np.ones(len(tangents))]) @ self.camera.axes
        face, _ = RayCaster(self.scene.vertices, self.scene.faces).first_hit(self.camera.position, rays)
        maps, seen = FaceMaps.of(self.scene), face >= 0
        points, places = np.full((len(rays), 3), np.nan), np.full((len(rays), 2), np.nan)
        hit, rays = face[seen], rays[seen]
        start = maps.offsets[hit] - maps.along_normal(hit, np.broadcast_to(self.camera.position, rays.shape))
        there = self.camera.position + rays * (start / maps.along_normal(hit, rays))[:, None]
        points[seen] = (there - self.camera.position) @ self.camera.axes.T
        places[seen] = np.where(self.scene.on_page[hit][:, None], maps.page(hit, there), np.nan)
        return points, places

    def captures(self, patterns: Iterable[Bytes], rng: np.random.Generator) -> Iterator[Bytes]:
        """(h, w, 3) uint8 RGB (sRGB): the camera's picture of each pattern (height, width) uint8."""
        paper, lamp, where = self._lit_surface()
        for pattern in patterns:
            shown = cv2.GaussianBlur(LINEAR[pattern], (0, 0), self.plan.focus_px)
            light = cv2.remap(shown, where, None, cv2.INTER_LINEAR, borderValue=0.0)
            seen = paper * (self.plan.ambient + lamp * light)[..., None] * self.plan.exposure
            codes = srgb(cv2.GaussianBlur(seen.astype(np.float32), (0, 0), self.plan.blur_px))
            noise = self.plan.noise * rng.standard_normal(codes.shape, dtype=np.float32)
            yield np.clip(np.rint(codes + noise), 0, 255).astype(np.uint8)

    def _lit_surface(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """What does not change between patterns, of each pixel (h, w): the reflectance (h, w, 3), the share of the
        projector's light that arrives, and the projector's pixel (h, w, 2) it comes from."""
        scene, camera, projector = self.scene, self.camera, self.projector
        caster, maps = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene)
        rays = camera.directions(0, camera.size[1])
        face, depth = caster.first_hit(camera.position, rays)
        seen = face >= 0
        face, points = face[seen], rays[seen] * depth[seen][:, None] + camera.position
        paper, lamp = np.zeros(rays.shape, np.float32), np.zeros(rays.shape[:2], np.float32)
        codes = colour_codes(scene, float(np.median(depth[seen])) / camera.focal_px)(face, maps.page(face, points))
        paper[seen] = linear(codes)
        beam = points - projector.position
        length = np.linalg.norm(beam, axis=1)
        _, reach = caster.first_hit(projector.position, beam)
        incidence = -maps.along_normal(face, beam) / length
        arrives = reach * length > length - SHADOW_MM
        reference = self.plan.distance_mm**2 + self.plan.baseline_mm**2
        lamp[seen] = np.where(arrives, np.clip(incidence, 0, None), 0.0) * reference / length**2
        where = np.full((*rays.shape[:2], 2), -1e6, np.float32)
        where[seen] = projector.project(points)
        return paper, lamp, where


def build_rig(
    sheet: Sheet,
    artwork: Artwork,
    plan: RigPlan | None = None,
    *,
    page_mm: PageSize = (280.0, 200.0),
    table: Table = "dark",
    aim_mm: tuple[float, float] = (0.0, 0.0),
) -> SimulatedRig:
    """A rig over a printed, warped page on a table; aim_mm: where the camera looks, from the middle of the page."""
    plan = plan or RigPlan()
    scene = place_sheet(sheet, printed(artwork, page_mm), depth_mm=plan.distance_mm, table=table)
    target = np.array([*aim_mm, -plan.distance_mm])
    direction = np.radians(plan.projector_deg)
    place = plan.baseline_mm * np.array([np.cos(direction), np.sin(direction), 0.0])
    camera = look_at(
        target,
        np.array([0.02, 0.03, 0.0]) * plan.distance_mm,
        size=plan.size,
        focal_px=plan.size[0] * plan.distance_mm / plan.view_mm,
        roll_deg=1.5,
        offset=(plan.size[0] * 0.004, -plan.size[0] * 0.003),
        radial=plan.radial,
        tangential=plan.tangential,
    )
    projector = look_at(
        target,
        place,
        size=plan.projector,
        focal_px=plan.projector[0] * float(np.hypot(plan.distance_mm, plan.baseline_mm)) / (plan.view_mm * LIT),
        roll_deg=-1.0,
        offset=(0.0, plan.projector[1] * 0.02),
        radial=(-0.03, 0.02, 0.0),
    )
    return SimulatedRig(camera, projector, plan, scene)
