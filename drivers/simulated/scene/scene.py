"""The simulated scene: a printed, warped page at its pose, on a table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from drivers.scanner import SettingsError
from drivers.simulated.scene.artwork import Print
from drivers.simulated.scene.light import DESK_LIGHT, Light
from drivers.simulated.scene.sheets import PageSize, Sheet
from drivers.simulated.scene.sheets.sheet import parameters
from restore.scan import Bytes, Floats, Ints, Mask

Table = Literal["none", "dark", "light", "white"]
TABLE_HALF_MM = 3000.0  # beyond the field of view of any lens
STEEPEST_DEG = 85.0  # a steeper wall counts as an overhang: nothing on it is legible


@parameters
class Pose:
    """Pose of the page, and of the table with it, under the scanner.

    tilt_deg  its upper edge away from the scanner.
    turn_deg  counter-clockwise in its own plane, seen from the scanner.
    shift_mm  right, up and towards the scanner.
    """

    tilt_deg: Annotated[float, Field(ge=-60, le=60)] = 0.0
    turn_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    shift_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)


@parameters
class Axle:
    """The axis of the turntable that carries the scene, in the scanner's frame.

    point_mm   any point on it.
    direction  of any length; turns are counter-clockwise seen against it.
    """

    point_mm: tuple[float, float, float] = (0.0, 0.0, -900.0)
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def motion(self, angle_deg: float) -> tuple[Floats, Floats]:
        """Return rotation (3, 3) and shift (3,) mm of a motion by an angle.

        A point p goes to rotation · p + shift.
        """
        along = np.asarray(self.direction) / np.linalg.norm(self.direction)
        rotation = Rotation.from_rotvec(np.radians(angle_deg) * along).as_matrix()
        return rotation, np.asarray(self.point_mm) - rotation @ self.point_mm


@dataclass(frozen=True, eq=False)
class Surface:
    """Exact surface of the page in the scanner's frame: the warped sheet, then a rigid motion."""

    sheet: Sheet
    page_mm: PageSize
    rotation: Floats
    shift: Floats

    def __call__(self, page_uv: Floats) -> Floats:
        """Return points (…, 3) mm in the scanner's frame.

        page_uv: (…, 2) mm from the lower left corner of the page.
        """
        return self.sheet.warp(page_uv - np.asarray(self.page_mm) / 2, self.page_mm) @ self.rotation.T + self.shift


@dataclass(frozen=True, eq=False)
class TablePicture:
    """A printed picture that lies on the table, as thin as paint.

    image      (h, w, 3) uint8 RGB (sRGB).
    dpi        of it.
    middle_mm  where its middle lies on the table, from below the middle of the page.
    turn_deg   counter-clockwise.
    """

    image: Bytes
    dpi: float
    middle_mm: tuple[float, float]
    turn_deg: float = 0.0


@dataclass(frozen=True, eq=False)
class Scene:
    """Triangle mesh in the scanner's frame.

    vertices: (n, 3) mm.
    page_uv: (n, 2) mm from the lower left corner of the page; for the table, mm on it from below the centre of the
        page.
    faces: (m, 3).
    on_page: (m,) bool, False for the faces of the table.
    lying: what lies on the table next to the page.
    """

    vertices: Floats
    page_uv: Floats
    faces: Ints
    on_page: Mask
    printed: Print
    table: Table
    surface: Surface
    light: Light = DESK_LIGHT
    lying: TablePicture | None = None

    def turned(self, angle_deg: float, axle: Axle) -> Scene:
        """The scene after a turntable has turned it, the table with it."""
        rotation, shift = axle.motion(angle_deg)
        page = self.surface
        surface = Surface(page.sheet, page.page_mm, rotation @ page.rotation, rotation @ page.shift + shift)
        return replace(self, vertices=self.vertices @ rotation.T + shift, surface=surface)

    def moved(self, shift_mm: Floats) -> Scene:
        """The scene, page and table, moved by (3,) mm."""
        surface = replace(self.surface, shift=self.surface.shift + shift_mm)
        return replace(self, vertices=self.vertices + shift_mm, surface=surface)


def place_sheet(
    sheet: Sheet,
    printed: Print,
    *,
    depth_mm: float,
    pose: Pose | None = None,
    table: Table = "dark",
    gap_mm: float = 3.0,
    light: Light | None = None,
) -> Scene:
    """Place a printed sheet, centred on the optical axis, `gap_mm` above the table.

    Raises SettingsError when the sheet has overhangs, which no scanner can see.
    """
    pose = pose or Pose()
    page_mm = printed.page_mm
    paper, faces = sheet.mesh(page_mm)
    warped = sheet.warp(paper, page_mm)
    _check_slopes(sheet, warped, faces)
    low, high = warped.min(axis=0), warped.max(axis=0)
    rotation = Rotation.from_euler("zx", [pose.turn_deg, -pose.tilt_deg], degrees=True).as_matrix()
    shift = np.asarray(pose.shift_mm) - [0, 0, depth_mm] - rotation @ (low + high) / 2
    surface = Surface(sheet, page_mm, rotation, shift)
    uv, on_page = paper + np.asarray(page_mm) / 2, np.ones(len(faces), bool)
    if table != "none":
        square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * TABLE_HALF_MM
        board = np.column_stack([square + (low + high)[:2] / 2, np.full(4, low[2] - gap_mm)])
        warped, uv = np.concatenate([warped, board]), np.concatenate([uv, square])
        faces = np.concatenate([faces, np.array([[0, 1, 2], [0, 2, 3]]) + len(paper)])
        on_page = np.append(on_page, [False, False])
    return Scene(warped @ rotation.T + shift, uv, faces, on_page, printed, table, surface, light or DESK_LIGHT)


def _check_slopes(sheet: Sheet, warped: Floats, faces: Ints) -> None:
    a, b, c = (warped[faces[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    if (normals[:, 2] < np.cos(np.radians(STEEPEST_DEG)) * np.linalg.norm(normals, axis=1)).any():
        raise SettingsError(f"the sheet {sheet.name!r} folds over itself", "bend it less, or make the page smaller")
