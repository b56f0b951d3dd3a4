"""Meshes of warped sheets whose flat truth is exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay
from scipy.stats.qmc import Halton

from drivers.simulated.scene.sheets import PageSize, Sheet
from restore.mesh.measures import straight_lengths
from restore.mesh.network import Network, make_network
from restore.mesh.pose import PosedSheet, pose_on_table
from restore.mesh.topology import Topology
from restore.scan import Floats, Ints, SurfaceMesh

PAGE_MM: PageSize = (280.0, 200.0)
DISTANCE_MM = 900.0  # of the scanner
CLEARANCE = 0.5  # of the mean spacing: nearer to the border the triangles would be slivers
MIN_AREA = 1e-9  # of the mean spacing squared: Delaunay leaves faces without area along straight borders


@dataclass(frozen=True, eq=False)
class ExactSheet:
    """A warped page: its mesh, the flat truth (n, 2) mm and the true lengths (e,) mm of its edges."""

    mesh: SurfaceMesh
    flat: Floats
    lengths: Floats

    def network(self, *, chords: bool = False) -> Network:
        """Sticks of the true lengths, or of the straight distances between the points, shorter over a bend."""
        return make_network(self.mesh.vertices, Topology(self.mesh.faces), None if chords else self.lengths)

    def posed(self) -> PosedSheet:
        """The sheet over the table."""
        return pose_on_table(self.mesh.vertices, self.mesh.faces)


def exact_sheet(
    sheet: Sheet, points: int, *, page_mm: PageSize = PAGE_MM, noise_mm: float = 0.0, seed: int = 0
) -> ExactSheet:
    """Exactly `points` irregular points on a warped page, seen with a noise of noise_mm along the lines of sight."""
    rng = np.random.default_rng(seed)
    flat, faces = scatter_points(points, page_mm, rng)
    vertices = add_noise(sheet.warp(flat, page_mm), np.array([0.0, 0.0, DISTANCE_MM]), noise_mm, rng)
    return ExactSheet(SurfaceMesh(vertices, faces), flat, straight_lengths(flat, Topology(faces).edges))


def add_noise(points: Floats, eye: Floats, noise_mm: float, rng: np.random.Generator) -> Floats:
    """Points (n, 3) mm moved along the lines of sight from an eye (3,) mm; by noise of standard deviation noise_mm."""
    sight = points - eye
    sight /= np.linalg.norm(sight, axis=1)[:, None]
    return points + sight * rng.normal(scale=noise_mm, size=(len(points), 1))


def scatter_points(points: int, page_mm: PageSize, rng: np.random.Generator) -> tuple[Floats, Ints]:
    """(n, 2) mm from the middle of the page, even along its border and irregular inside, and (m, 3) faces."""
    size = np.asarray(page_mm)
    step = np.sqrt(size.prod() / points)
    across, up = np.maximum(np.round(size / step).astype(int), 1)
    x, y = np.linspace(0, 1, across + 1)[:-1], np.linspace(0, 1, up + 1)[:-1]
    quarter = [np.stack([x, 0 * x], 1), np.stack([0 * y + 1, y], 1)]
    border = np.concatenate([*quarter, *(1 - side for side in quarter)]) * size
    inner = Halton(2, seed=rng).random(points - len(border)) * (size - 2 * CLEARANCE * step) + CLEARANCE * step
    flat = np.concatenate([border, inner]) - size / 2
    faces = Delaunay(flat).simplices.astype(np.int64)
    a, b, c = (flat[faces[:, k]] for k in range(3))
    doubled = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    faces = np.where(doubled[:, None] > 0, faces, faces[:, ::-1])
    return flat, faces[np.abs(doubled) > MIN_AREA * step**2]
