"""Sheets folded along straight creases: a map folded several times, and a Miura fold."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from drivers.scanner import SettingsError
from drivers.simulated.scene.sheets.facets import WELD_MM, areas_of, clip, level, mesh_of_polygons, split
from drivers.simulated.scene.sheets.sheet import PageSize, corners, parameters
from restore.scan import Floats, Ints

FoldAngle = Annotated[float, Field(ge=-150, le=150)]
Crease = tuple[float, Annotated[float, Field(ge=-80, le=80)], FoldAngle]


@parameters
class MultiFold:
    """A sheet folded along creases that run from edge to edge.

    creases  from left to right: (mm from the middle of the page to the crease on its horizontal middle line, degrees
             that the crease leans to the right, degrees of the fold, positive where the paper rises after it). Creases
             must not meet on the page.
    """

    name: ClassVar[str] = "multifold"
    creases: tuple[Crease, ...] = ((-75.0, 6.0, 40.0), (-5.0, -4.0, -48.0), (70.0, 8.0, 36.0))

    def warp(self, paper: Floats, page_mm: PageSize) -> Floats:
        """Map flat points to space, (…, 3) mm: a facet moves rigidly with the folds to its left."""
        rotations, shifts = self._motions(page_mm)
        facet = sum(self._right_of(crease, paper) > 0 for crease in self.creases) + np.zeros(paper.shape[:-1], int)
        return np.einsum("...ij,...j->...i", rotations[facet][..., :2], paper) + shifts[facet]

    def mesh(self, page_mm: PageSize) -> tuple[Floats, Ints]:
        """The facets between creases: points (n, 2) mm of the flat page and triangles (m, 3)."""
        return mesh_of_polygons(self._facets(page_mm))

    def _facets(self, page_mm: PageSize) -> list[Floats]:
        rest, facets = corners(page_mm), []
        for crease in self.creases:
            left, rest = split(rest, self._right_of(crease, rest))
            facets.append(left)
        facets.append(rest)
        if any(len(p) == 0 for p in facets) or not self._apart(facets):
            raise SettingsError(
                "the creases meet on the page or lie outside it", "give creases from left to right that do not cross"
            )
        return facets

    def _apart(self, facets: list[Floats]) -> bool:
        """Whether every facet lies wholly to the left of all creases after it."""
        return all(self._right_of(c, p).max() < WELD_MM for i, p in enumerate(facets) for c in self.creases[i:])

    @staticmethod
    def _right_of(crease: Crease, paper: Floats) -> Floats:
        offset, lean = crease[0], np.radians(crease[1])
        return np.asarray((paper[..., 0] - offset) * np.cos(lean) - paper[..., 1] * np.sin(lean))

    def _motions(self, page_mm: PageSize) -> tuple[Floats, Floats]:
        """Rotations (n, 3, 3) and shifts (n, 3) mm of the facets, levelled."""
        rotation, shift = np.eye(3), np.zeros(3)
        rotations, shifts = [rotation], [shift]
        for offset, lean_deg, fold_deg in self.creases:
            lean, point = np.radians(lean_deg), np.array([offset, 0.0, 0.0])
            turn = Rotation.from_rotvec(-np.radians(fold_deg) * np.array([np.sin(lean), np.cos(lean), 0.0])).as_matrix()
            shift = rotation @ (point - turn @ point) + shift
            rotation = rotation @ turn
            rotations.append(rotation)
            shifts.append(shift)
        normals = np.array(rotations)[:, :, 2]
        upright = level(normals, areas_of(self._facets(page_mm)))
        return upright @ np.array(rotations), np.array(shifts) @ upright.T


@parameters
class Miura:
    """Miura fold: parallelograms in rows and columns.

    They are creased in two directions at once. Positions of the vertices follow M. Schenk and S. Guest, "Geometry of
    Miura-folded metamaterials", PNAS 110 (2013), eqs. 1–4.
    side_mm: length of a parallelogram along the straight creases, which run up the page.
    width_mm: length of its other side, along the zigzag creases.
    acute_deg: the angle between the two.
    fold_deg: how far each parallelogram is tilted: 0 is flat.
    """

    name: ClassVar[str] = "miura"
    side_mm: Annotated[float, Field(ge=10, le=500)] = 50.0
    width_mm: Annotated[float, Field(ge=10, le=500)] = 56.0
    acute_deg: Annotated[float, Field(ge=20, le=89)] = 72.0
    fold_deg: Annotated[float, Field(ge=0, le=75)] = 30.0

    def warp(self, paper: Floats, page_mm: PageSize) -> Floats:  # noqa: ARG002 (the same on every page)
        """Map flat points to space, (…, 3) mm: a parallelogram follows its corner and sides."""
        column, row, across, along = self._cell(paper)
        odd_column, odd_row = column % 2, row % 2
        theta, gamma = np.radians(self.fold_deg), np.radians(self.acute_deg)
        sin, cos = np.sin(theta), np.cos(theta)
        spread = np.sqrt(1 + cos**2 * np.tan(gamma) ** 2)
        height = self.side_mm * sin * np.sin(gamma)
        pitch_x = self.width_mm * cos * np.tan(gamma) / spread
        pitch_y = self.side_mm * np.sqrt(1 - sin**2 * np.sin(gamma) ** 2)
        stagger = self.width_mm / spread
        x = (column + across) * pitch_x
        y = (row + along) * pitch_y + stagger * np.where(odd_column, 1 - across, across)
        z = height * np.where(odd_row, 1 - along, along)
        return np.stack([x, y, z], axis=-1)

    def mesh(self, page_mm: PageSize) -> tuple[Floats, Ints]:
        """Return the parallelograms cut at the page's edge: points (n, 2) mm, triangles (m, 3)."""
        reach = np.asarray(page_mm) / 2
        columns = int(np.ceil(reach[0] / self._column_mm)) + 1
        rows = int(np.ceil((reach[1] + self._stagger_mm) / self.side_mm)) + 1
        cells = [self._corners(i, j) for i in range(-columns, columns) for j in range(-rows, rows)]
        return mesh_of_polygons([clip(cell, page_mm) for cell in cells])

    @property
    def _column_mm(self) -> float:
        return float(self.width_mm * np.sin(np.radians(self.acute_deg)))

    @property
    def _stagger_mm(self) -> float:
        return float(self.width_mm * np.cos(np.radians(self.acute_deg)))

    def _cell(self, paper: Floats) -> tuple[Ints, Ints, Floats, Floats]:
        """Return column and row of the parallelogram under each point.

        Returns also the place in it, 0 to 1 across and along.
        """
        column = np.floor(paper[..., 0] / self._column_mm)
        across = paper[..., 0] / self._column_mm - column
        up = (paper[..., 1] - self._stagger_mm * np.where(column % 2, 1 - across, across)) / self.side_mm
        row = np.floor(up)
        return column.astype(np.int64), row.astype(np.int64), across, up - row

    def _corners(self, column: int, row: int) -> Floats:
        left, right = (
            np.array([(column + k) * self._column_mm, row * self.side_mm + self._stagger_mm * ((column + k) % 2)])
            for k in (0, 1)
        )
        up = np.array([0.0, self.side_mm])
        return np.array([left, right, right + up, left + up])
