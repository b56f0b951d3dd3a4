"""A page on a range grid.

A coarse mesh of it is flattened, and refined to a fine one for the picture.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from restore.camera.rays import Rays
from restore.findings import Finding
from restore.flattening.methods import OnStep, flatten_with_lengths
from restore.mesh.decimate import decimate
from restore.mesh.topology import Topology
from restore.mesh.triangulate import lattice
from restore.outline.sides import Line, Side, straighten
from restore.page import FlatMesh
from restore.prepared.prepared import Clock, KindsOfRows, Prepared, Unrolled, square_to_picture, upright_as_textured
from restore.prepared.refine import interpolate_flat_positions, refine, subdivide
from restore.range_image.facets.normals import facet_normals
from restore.range_image.facets.sheet import PageOnGrid, Sheet, depth_distance
from restore.report import SampleReport
from restore.runtime.rows import Rows
from restore.scan import Bytes, Floats, Mask, SurfaceMesh
from restore.settings import Settings
from restore.texture.coverage import CoverageClass
from restore.texture.occlusion import viewpoint
from restore.texture.page import PageMap, page_map, rasterise_on_page

MAX_SOLVED_POINTS = 10_000  # vertices; more gain no accuracy and cost seconds
# Samples from node to node of the lattice that is decimated → nodes for each requested point, at least. The facets
# average 7×7 samples; the time of decimation is that of its nodes, and the widest step leaves it a choice of nodes.
STRIDES = {1: 1.0, 2: 1.0, 3: 1.0, 4: 1.0, 5: 6.0, 6: 6.0}
# Fractions of a sheet's border above which they are reported.
BORDERS = {
    "lost_border": 0.01,  # a centimetre of an A4 page; where no paper was lost it is 0
    "turned_border": 0.02,  # of pages that are seen to their edges, corners alone are
}
HALF = 0.5  # of a sample: between one in a hole and one on the paper the edge is half-way


@dataclass(frozen=True, eq=False)
class FacetSheet(Prepared):
    """A page on a range grid: facets give its points, lengths and normals everywhere.

    erased  (rows, cols) True where paper is removed by hand.
    """

    sheet: Sheet
    is_one_shot: bool = False
    erased: Mask | None = field(default=None, kw_only=True)

    def unroll(self, settings: Settings, clock: Clock, on_step: OnStep | None = None) -> Unrolled:
        """Return the flat page: decimated, flattened by facets' lengths, refined, straightened."""
        unrolled = unroll(self.sheet, settings, clock, on_step)
        return unrolled if self.is_one_shot else upright_as_textured(unrolled)

    @property
    def as_scanned(self) -> FacetSheet:
        """The sheet without the paper that is removed by hand."""
        return replace(self, erased=None)

    @property
    def on_grid(self) -> Sheet:
        """The sheet itself."""
        return self.sheet

    def with_noise(self) -> Sheet | str:
        """Return the sheet of a scanner's own image, or why it is missing."""
        return self.sheet if self.is_one_shot else super().with_noise()

    def on_own_grid(self, rays: Rays, mask: Mask) -> Mask:
        """Return a mask on the sheet's grid, (rows, cols).

        mask: (rows, cols), on the grid of rays that it was cut out of.
        """
        down, right = ((self.sheet.rays.y0 - rays.y0) / rays.dy, (self.sheet.rays.x0 - rays.x0) / rays.dx)
        rows, cols = (
            np.arange(size) + round(first) for size, first in zip(self.sheet.inside.shape, (down, right), strict=True)
        )
        known = (rows >= 0) & (rows < mask.shape[0]), (cols >= 0) & (cols < mask.shape[1])
        own = mask[np.clip(rows, 0, mask.shape[0] - 1)[:, None], np.clip(cols, 0, mask.shape[1] - 1)]
        return np.asarray(own & known[0][:, None] & known[1])

    @property
    def facts(self) -> SampleReport:
        """How many samples were measured on it, and how much of it is filled in."""
        measured = self.sheet.measured
        return {
            "samples": int(measured.sum()),
            "interpolated_fraction": float(1.0 - measured[self.sheet.inside].mean()),
        }

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Where its border may go on, unseen."""
        fractions = {name: getattr(self.sheet, name) for name in BORDERS}
        return tuple(Finding.of(name, fraction) for name, fraction in fractions.items() if fraction > BORDERS[name])

    def normals_on(self, fine: FlatMesh, dpi: float, axes: Floats) -> PageMap:
        """Return the normal (h, w, 3) of the nearest facet.

        Those that meet at a crease must not be mixed.
        axes: (3, 3).
        """
        rows, cols = self.sheet.rays.grid(fine.vertices)
        at = np.ascontiguousarray(page_map(fine.flat, fine.faces, np.column_stack([cols, rows]), dpi))
        nearest = cv2.remap(facet_normals(self.sheet), at, None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
        normals: PageMap = nearest @ axes.T.astype(np.float32)
        normals[np.isnan(at[..., 0])] = np.nan
        return normals

    def kinds_by_rows(self, fine: FlatMesh, dpi: float) -> KindsOfRows:
        """Return MEASURED or INTERPOLATED as the samples are.

        OUTSIDE in holes that show the table.
        """
        grid_xy = np.stack(self.sheet.rays.grid(fine.vertices), axis=1)[:, ::-1]
        samples = np.where(self.sheet.measured, CoverageClass.MEASURED, CoverageClass.INTERPOLATED).astype(np.uint8)
        has_holes = self.sheet.holes is not None and self.sheet.holes.any()
        holes = np.asarray(self.sheet.holes, np.float32) if has_holes else None
        erased = None if self.erased is None else self.erased.astype(np.float32)

        def find(page: Mask, top: int) -> Bytes:
            at = rasterise_on_page(fine, grid_xy, page.shape, dpi, slice(top, top + len(page)))
            kinds = cv2.remap(samples, at, None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
            kinds *= page  # OUTSIDE is 0
            if holes is not None:
                kinds[cv2.remap(holes, at, None, cv2.INTER_LINEAR) > HALF] = CoverageClass.OUTSIDE
            if erased is not None:
                gone = cv2.remap(erased, at, None, cv2.INTER_LINEAR) > HALF
                kinds[gone & (kinds != CoverageClass.OUTSIDE)] = CoverageClass.ERASED
            return np.asarray(kinds)

        def find_in_bands(page: Mask, top: int) -> Bytes:
            def kinds(rows: slice) -> Bytes:
                return find(page[rows], top + rows.start)

            return np.asarray(Rows(page.shape, np.uint8, kinds)())

        return find_in_bands

    def camera_centre(self, fine: FlatMesh) -> Floats | None:
        """Return the lens, (3,) mm, of the scanner, or of a mesh's own picture."""
        origin = self.sheet.rays.origin
        return viewpoint(fine) if origin.any() else origin

    def cut_by_samples(self) -> float:
        """That in the first and last rows and columns of the range image."""
        return self.sheet.cut


def no_sides(_page: PageOnGrid) -> Mapping[Side, Line]:
    """No side is known before it is fitted."""
    return {}


def unroll(
    sheet: Sheet,
    settings: Settings,
    clock: Clock,
    on_step: OnStep | None = None,
    *,
    given: Callable[[PageOnGrid], Mapping[Side, Line]] = no_sides,
) -> Unrolled:
    """Return the flat page: decimated, flattened by facets' lengths, refined, straightened.

    clock: clock(stage) times the stages.
    given: the sides of the flat page that are known already.
    """
    requested = settings.points or int(sheet.inside.sum())
    with clock("decimate"):
        mesh, nodes = decimate_sheet(sheet, min(requested, MAX_SOLVED_POINTS))
        distance = depth_distance(sheet, nodes, mesh.faces)
    with clock("flatten"):
        lengths = sheet.lengths(nodes, Topology(mesh.faces).edges)
        coarse = flatten_with_lengths(mesh, lengths, settings.method, on_step=on_step)
    with clock("refine"):
        fine, fine_nodes = refine(sheet, coarse, nodes)
        fine = square_to_picture(fine)
        page = PageOnGrid(fine.flat, fine.faces, fine_nodes)
        page = subdivide(sheet, straighten(sheet, page, given(page)))
        fine = _on_sheet(sheet, fine, page)
        if requested > MAX_SOLVED_POINTS:
            mesh, nodes = decimate_sheet(sheet, requested)
        points = _interpolated(sheet, page, mesh, nodes, fine)
    return Unrolled(points, fine, page.nodes, distance)


def decimate_sheet(sheet: Sheet, points: int) -> tuple[SurfaceMesh, Floats]:
    """Return a mesh of about `points` points of the sheet, and their grid positions (n, 2)."""
    samples = int(sheet.inside.sum())
    strides = [stride for stride, nodes in STRIDES.items() if samples >= nodes * points * stride**2]
    nodes, faces = lattice(sheet.inside, max(strides, default=1))
    vertices, faces = decimate(sheet.points(nodes), faces, points)
    nodes = np.stack(sheet.rays.grid(vertices), axis=1)
    source = sheet.scan
    mesh = SurfaceMesh(
        vertices, faces, sheet.texcoords(nodes), source.texture, source.provenance, findings=source.findings
    )
    return mesh, nodes


def _on_sheet(sheet: Sheet, solved: FlatMesh, page: PageOnGrid) -> FlatMesh:
    """Return the page with its surface, measured on the sheet.

    solved: the flat mesh that it was made of.
    """
    nodes, lengths = page.nodes, sheet.lengths(page.nodes, page.topology.edges)
    points, texcoords = sheet.points(nodes), sheet.texcoords(nodes)
    return replace(solved, vertices=points, faces=page.faces, texcoords=texcoords, flat=page.flat, lengths=lengths)


def _interpolated(sheet: Sheet, page: PageOnGrid, mesh: SurfaceMesh, nodes: Floats, solved: FlatMesh) -> FlatMesh:
    """Flatten a mesh by interpolation of a solved page.

    nodes: (n, 2), grid positions of the mesh.
    """
    edges = Topology(mesh.faces).edges
    flat = interpolate_flat_positions(sheet.inside.shape, page.nodes, page.faces, page.flat, nodes)
    lengths = sheet.lengths(nodes, edges)
    return FlatMesh.of(mesh, flat, lengths, solved.iterations, **solved.convergence)
