"""One leaf of an opened book, with a strip of the facing page.

It has the samples on its side of the spine. The leaf is flattened alone, because two leaves are two developable sheets
and not one. The strip is attached to its side at the spine afterwards, so that its fold has no part in the shape of the
leaf.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from restore.camera.rays import Rays
from restore.flattening.methods import OnStep
from restore.mesh.measures import straight_lengths
from restore.mesh.topology import Topology
from restore.outline.sides import Line, Side
from restore.page import FlatMesh
from restore.prepared.facet_sheet import FacetSheet, unroll
from restore.prepared.prepared import Clock, KindsOfRows, Unrolled
from restore.prepared.refine import interpolate_flat_positions
from restore.prepared.separate import LeafSpine
from restore.range_image.facets.sheet import PageOnGrid, Sheet
from restore.scan import Bytes, Floats, Ints, Mask, Part
from restore.settings import Settings
from restore.texture.coverage import CoverageClass
from restore.texture.page import rasterise_on_page

A_LEAF = "a leaf of an opened book is not covered: restore the opening whole"
PLACES = 17  # along the spine, that its line on the flat page is fitted to
AT_SPINE_MM = 0.5  # from its line: the border was moved onto it, as it was before the vertices found their rows


@dataclass(frozen=True, eq=False)
class LeafSheet(FacetSheet):
    """A leaf of an opened book.

    spine  on the sheet's own grid.
    side   of the spine on which the leaf is.
    """

    spine: LeafSpine = field(kw_only=True)
    side: Part = field(kw_only=True)

    def unroll(self, settings: Settings, clock: Clock, on_step: OnStep | None = None) -> Unrolled:
        """The flat leaf, its side at the spine given, with the strip of the facing page."""
        return self._with_strip(unroll(self.sheet, settings, clock, on_step, given=self._spine_side))

    def with_noise(self) -> Sheet | str:
        """Return the reason: the line of the spine has errors that are not estimated."""
        return A_LEAF if self.is_one_shot else super().with_noise()

    @property
    def sign(self) -> int:
        """1 where the spine is on the right of the leaf, −1 where it is on its left."""
        return 1 if self.side == "left" else -1

    def _spine_side(self, page: PageOnGrid) -> Mapping[Side, Line]:
        rows = np.linspace(page.nodes[:, 0].min(), page.nodes[:, 0].max(), PLACES)
        nodes = np.column_stack([rows, np.interp(rows, np.arange(len(self.spine.cols)), self.spine.cols)])
        places = interpolate_flat_positions(self.sheet.inside.shape, page.nodes, page.faces, page.flat, nodes)
        slope, offset = np.polyfit(places[:, 1], places[:, 0], 1)
        normal = self.sign * np.array([1.0, -slope]) / np.hypot(1.0, slope)
        return {(0, self.sign): Line(normal, float(normal @ [offset, 0.0]))}

    def _with_strip(self, page: Unrolled) -> Unrolled:
        """The flat leaf with a strip of the facing page along its side at the spine."""
        fine, nodes = page.fine, page.nodes
        (line,) = self._spine_side(PageOnGrid(fine.flat, fine.faces, nodes)).values()
        far = line.signed_distance(fine.flat)
        start, end = _border(fine.faces).T
        at_spine = (np.abs(far[start]) < AT_SPINE_MM) & (np.abs(far[end]) < AT_SPINE_MM)
        edges = np.column_stack([start, end])[at_spine]
        if len(edges) == 0:
            return page
        own = np.unique(edges)
        row = nodes[own, 0]
        beyond = np.column_stack([row, np.interp(row, np.arange(len(self.spine.facing)), self.spine.facing)])
        flat = fine.flat[own] + self.spine.overlap_mm * line.normal
        a, b = edges.T
        past_a, past_b = (len(fine.flat) + np.searchsorted(own, one) for one in (a, b))
        strip = np.concatenate([np.column_stack([b, a, past_a]), np.column_stack([b, past_a, past_b])])
        return replace(page, fine=self._extended(fine, strip, flat, beyond), nodes=np.concatenate([nodes, beyond]))

    def _extended(self, fine: FlatMesh, strip: Ints, flat: Floats, nodes: Floats) -> FlatMesh:
        """Return the flat mesh with the faces (k, 3) of a strip.

        flat, nodes: (n, 2) mm and (n, 2), of the strip's further vertices.
        """
        assert fine.texcoords is not None
        faces, flat = np.concatenate([fine.faces, strip]), np.concatenate([fine.flat, flat])
        edges = Topology(faces).edges
        lengths = straight_lengths(flat, edges)
        lengths[np.searchsorted(_keys(edges, len(flat)), _keys(fine.edges, len(flat)))] = fine.lengths
        return replace(
            fine,
            vertices=np.concatenate([fine.vertices, self.sheet.points(nodes)]),
            texcoords=np.concatenate([fine.texcoords, self.sheet.texcoords(nodes)]),
            faces=faces,
            flat=flat,
            lengths=lengths,
        )

    def kinds_by_rows(self, fine: FlatMesh, dpi: float) -> KindsOfRows:
        """Return the coverage as for any sheet, FACING on the strip of the facing page."""
        of_sheet = super().kinds_by_rows(fine, dpi)
        rows, cols = self.sheet.rays.grid(fine.vertices)
        on_grid = np.column_stack([cols, rows])
        spine = np.ascontiguousarray(self.spine.cols[:, None], np.float32)

        def find(page: Mask, top: int) -> Bytes:
            kinds = of_sheet(page, top)
            at = rasterise_on_page(fine, on_grid, page.shape, dpi, slice(top, top + len(page)))
            border = cv2.remap(spine, np.zeros_like(at[..., 0]), np.nan_to_num(at[..., 1]), cv2.INTER_LINEAR)
            kinds[(self.sign * (at[..., 0] - border) > 0) & (kinds != CoverageClass.OUTSIDE)] = CoverageClass.FACING
            return kinds

        return find


def _border(faces: Ints) -> Ints:
    """Return sides (k, 2) of faces (m, 3) that no other face has in their direction."""
    sides = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    count = int(faces.max()) + 1
    return np.asarray(sides[~np.isin(_keys(sides, count), _keys(sides[:, ::-1], count))])


def _keys(edges: Ints, count: int) -> Ints:
    """Return a number (e,) for each edge (e, 2), ascending as the edges do."""
    return np.asarray(edges[:, 0] * count + edges[:, 1])


def leaf_of(whole: FacetSheet, rays: Rays, spine: LeafSpine, side: Part) -> LeafSheet:
    """Return the leaf of a prepared sheet.

    spine: on the grid of rays from which the sheet was cut out.
    """
    sheet = whole.sheet
    down, right = (sheet.rays.y0 - rays.y0) / rays.dy, (sheet.rays.x0 - rays.x0) / rays.dx
    rows = np.clip(np.arange(sheet.inside.shape[0]) + round(down), 0, len(spine.cols) - 1)
    own = LeafSpine(spine.cols[rows] - right, spine.facing[rows] - right, spine.overlap_mm)
    leaf = LeafSheet(sheet, whole.is_one_shot, spine=own, side=side)
    return replace(leaf, erased=whole.erased)
