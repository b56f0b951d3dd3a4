"""A creased page: its relief over a smooth sheet.

Neither the places nor the number of its creases are known. Of all reliefs through the points, that is taken which bends
in the fewest places (`lattice`); near a crease, where no point is, its facets are prolonged to where they meet
(`facets`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy import ndimage

from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.surfaces.facets import prolonged
from restore.photogrammetry.surfaces.lattice import Cloud, Lattice
from restore.photogrammetry.surfaces.surface import Surface, fit_surface
from restore.report import SurfaceReport
from restore.scan import Floats, Ints, Mask

BASE_STIFFNESS = 1e5  # mm⁴: of the sheet below, whose normals hardly turn from one facet to the next
NODES = 40_000  # of the lattice: 1.4 mm on A4, where the mesh of an exact page of many facets is right to 0.02 mm
STAGES = ((1.0, 6), (0.5, 5), (0.0, 6))  # a new relief takes the first, one that is nearly right the last
UNCREASED = 0.2  # radians, 11°: within a patch that lies on one facet, rounded by noise and lattice


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights (rows, cols) mm along the normals of a smooth base.

    They are of nodes a step apart from low (2,) mm on. Places are those of the base: they are not those of the flat
    page.
    """

    piece_count: ClassVar[int] = 1
    base: Surface
    low: Floats
    step: float
    heights: Floats

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """The rectangle from low (2,) to high (2,) mm of the base."""
        return self.base.bounds

    @property
    def smooth(self) -> Surface:
        """The base."""
        return self.base

    def lattice(self) -> Lattice:
        """The nodes on the base."""
        return _lattice(self.base, self.low, self.step, self.heights.shape)

    def points(self, places: Floats) -> Floats:
        """Return points (n, 3) mm at places (n, 2) mm of the base."""
        on_base, _, normals, _ = self.base.frames(places)
        return np.asarray(on_base + self._heights(places)[:, None] * normals)

    def normals(self, places: Floats) -> Floats:
        """Return unit normals (n, 3) at places (n, 2) mm of the base."""
        return self.frames(places)[2]

    def frames(self, places: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return points, tangents, normals and curvatures at places (n, 2) mm.

        They are (n, 3) mm, (n, 2, 3), (n, 3) and (n, 3) 1/mm, as in `Surface.frames`; a facet has no curvature.
        """
        along, up = (self._difference(places, move) for move in np.eye(2) * self.step / 2)
        normals = np.cross(along, up)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        first = along / np.linalg.norm(along, axis=1, keepdims=True)
        tangents = np.stack([first, np.cross(normals, first)], axis=1)
        return self.points(places), tangents, normals, np.zeros((len(places), 3))

    def feet(self, points: Floats, start: Floats) -> Floats:
        """Return places (n, 2) mm of the base below points (n, 3) mm.

        start: (n, 2), places to search from.
        """
        return self.base.feet(points, start)

    def moved(self, similarity: Similarity) -> Relief:
        """The relief in another frame; its places stay as they are."""
        return replace(self, base=self.base.moved(similarity), heights=similarity.scale * self.heights)

    def uncreased(self, places: Floats, half: float) -> Mask:
        """Return whether a square about each place lies on one facet.

        half: half a side, mm. places: (n, 2) mm. Returns (n,) bool.
        """
        own = self.normals(places)
        whole = np.ones(len(places), bool)
        for corner in half * np.array([[-1, -1], [0, -1], [1, -1], [1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0]]):
            whole &= np.linalg.norm(self.normals(places + corner) - own, axis=1) < UNCREASED
        return whole

    def creased(self, places: Floats, faces: Ints) -> Floats:  # noqa: ARG002 (as of pieces that meet)
        """Return mesh vertices (n, 3) mm at places (n, 2) mm."""
        return self.points(places)

    def flat_corners(self, vertices: Floats, faces: Ints, places: Floats) -> None:
        """Return None: facets (m, 3) have no flat page of their own."""

    def gutter_widths(self) -> None:
        """Return None: no crease parts it in two."""

    def described(self, stiffness: float) -> SurfaceReport:  # noqa: ARG002 (as of a smooth surface)
        """Return what a report says of it."""
        return {"shape": "facets", "stiffness_mm4": None, "smooth_pieces": None}

    def edge_counts(self, places: Floats, measured: Mask, spacing: float) -> Ints:  # noqa: ARG002 (as of a folded one)
        """Return (n,) ones: of an edge all points count, with the noise that they have."""
        return np.ones(len(places), np.int64)

    def through(self, cloud: Cloud, stiffness: float = 0.0) -> Relief:  # noqa: ARG002 (as of a smooth surface)
        """Return the relief fitted to a cloud over its base, with facets prolonged to its creases."""
        lattice, above = self.lattice(), _above(self.base, cloud.points, cloud.feet)
        heights = lattice.fitted(cloud.feet, above, STAGES, noise=cloud.noise)
        heights = prolonged(lattice, heights, cloud.feet, above, cloud.of_facets, cloud.noise)
        return replace(self, heights=lattice.fitted(cloud.feet, above, STAGES[-1:], start=heights, noise=cloud.noise))

    def _heights(self, places: Floats) -> Floats:
        nodes = (places - self.low)[:, ::-1].T / self.step
        return ndimage.map_coordinates(self.heights, nodes, order=1, mode="nearest")

    def _difference(self, places: Floats, move: Floats) -> Floats:
        return np.asarray(self.points(places + move) - self.points(places - move))


def raise_relief(points: Floats, feet: Floats, smooth: Surface) -> Relief:
    """Return the relief through points, its creases still rounded.

    points: (n, 3) mm.
    feet: (n, 2) mm, on a smooth surface.
    Raises SheetLost.
    """
    base, feet = fit_surface(points, feet, smooth, stiffness=BASE_STIFFNESS)
    low, high = base.bounds
    step = float(np.sqrt(np.prod(high - low) / NODES))
    cols, rows = (np.floor((high - low) / step).astype(int) + 1).tolist()
    lattice = _lattice(base, low, step, (rows, cols))
    return Relief(base, low, step, lattice.fitted(feet, _above(base, points, feet), STAGES[:1]))


def _above(base: Surface, points: Floats, feet: Floats) -> Floats:
    """Return the height (n,) mm of points over a base at their feet.

    points: (n, 3).
    feet: (n, 2).
    """
    on_base, _, normals, _ = base.frames(feet)
    return np.asarray(((points - on_base) * normals).sum(axis=1))


def _lattice(base: Surface, low: Floats, step: float, shape: tuple[int, ...]) -> Lattice:
    rows, cols = shape
    x, y = low[0] + step * np.arange(cols), low[1] + step * np.arange(rows)
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    points, _, normals, _ = base.frames(places)
    return Lattice(low, step, points.reshape(rows, cols, 3), normals.reshape(rows, cols, 3))
