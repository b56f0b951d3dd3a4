"""A prepared page, before it is flattened, and the flat page.

Any kind of scan becomes one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np

from restore.findings import Finding
from restore.flattening.methods import OnStep
from restore.mesh.measures import vertex_normals
from restore.numerics.limits import SINGLE_TINY
from restore.numerics.robust import MAJORITY
from restore.outline.rectangle import has_straight_sides, squaring_rotation
from restore.page import FlatMesh
from restore.range_image.facets.sheet import Sheet
from restore.report import DistanceReport, SampleReport
from restore.runtime.results import Kept
from restore.scan import Bytes, Floats, Ints, Mask
from restore.settings import Method, Settings
from restore.texture.coverage import Coverage, CoverageClass, cut_findings, filled_findings
from restore.texture.occlusion import viewpoint
from restore.texture.page import PageMap, Painting, page_map

NO_NOISE = "a mesh has no noise of single rays: give the range image"

Step = tuple[int, Floats, Ints]  # of a flattening, as a watcher of its steps gets it
Clock = Callable[[str], AbstractContextManager[None]]
# Whether pixels (rows, w) are on the page, from which row of it on → how their shape is known, (rows, w).
KindsOfRows = Callable[[Mask, int], Bytes]


@dataclass(frozen=True, eq=False)
class Unrolled:
    """The flat page as meshes.

    coarse    the mesh of the requested number of points, with flat positions interpolated from the fine mesh.
    fine      the mesh that maps the picture to the page.
    nodes     (k, 2) grid positions of the vertices of the fine mesh; empty for a mesh without a grid.
    distance  depth between the coarse mesh and the surface, mm; empty for a mesh without a grid.
    """

    coarse: FlatMesh
    fine: FlatMesh
    nodes: Floats
    distance: DistanceReport


class Prepared(ABC):
    """Page ready to be flattened.

    Each kind of scan has its own; the defaults are those of a plain mesh.
    is_one_shot: whether it comes from one picture of a scanner, which the page may leave; a mesh may have an atlas.
    """

    is_one_shot: bool = False

    @abstractmethod
    def unroll(self, settings: Settings, clock: Clock, on_step: OnStep | None = None) -> Unrolled:
        """Return the flat page with about `settings.points` points: all of them for 0.

        clock: clock(stage) times the stages.
        """

    @property
    def as_scanned(self) -> Prepared:
        """What decides its shape: the page without corrections that change nothing of it."""
        return self

    @property
    def on_grid(self) -> Sheet | None:
        """The sheet on its range grid; None for a page without one."""
        return None

    def with_noise(self) -> Sheet | str:
        """Return the sheet whose single rays have noise, or why it is missing."""
        return NO_NOISE

    @property
    def facts(self) -> SampleReport:
        """Further fields of the report."""
        return {}

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is to be reported of the border of the surface."""
        return ()

    def normals_on(self, fine: FlatMesh, dpi: float, axes: Floats) -> PageMap:
        """Return unit normals (h, w, 3) on the printed side of a flat page.

        In the frame of rows `axes` (3, 3); NaN off the page.
        """
        normals = page_map(fine.flat, fine.faces, vertex_normals(fine.vertices, fine.faces) @ axes.T, dpi)
        return normals / np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), SINGLE_TINY)

    def kinds_on(self, fine: FlatMesh, page: Mask, dpi: float) -> Bytes:
        """Return how the shape of a flat page (h, w) is known: values as of `kinds_by_rows`."""
        return self.kinds_by_rows(fine, dpi)(page, 0)

    def kinds_by_rows(self, fine: FlatMesh, dpi: float) -> KindsOfRows:  # noqa: ARG002 - others need both
        """Return how the shape of a flat page is known.

        MEASURED, INTERPOLATED, or OUTSIDE in holes.
        """
        return lambda page, _top: np.where(page, CoverageClass.MEASURED, CoverageClass.OUTSIDE).astype(np.uint8)

    def camera_centre(self, fine: FlatMesh) -> Floats | None:
        """Return the centre (3,) mm of the texture's camera, None without a single one."""
        return viewpoint(fine)

    def cut_by_samples(self) -> float:
        """Return the fraction of the border that may continue where no picture decides it."""
        return 0.0

    def findings_on(self, painting: Painting, coverage: Coverage, dpi: float) -> list[Finding]:
        """Return the findings about a textured page.

        Where it ends, and where its shape is not measured.
        """
        filled = filled_findings(coverage.seen, dpi)
        if not self.is_one_shot or painting.page_source is not None:
            return filled
        return [*cut_findings(self.cut_by_samples() if coverage.cut is None else coverage.cut), *filled]


def unrolled(
    page: Prepared, settings: Settings, clock: Clock, on_step: OnStep | None = None, kept: Kept | None = None
) -> Unrolled:
    """Return the flat page of a prepared one, or that which was kept of it."""
    if kept is None:
        return page.unroll(settings, clock, on_step)
    shape = page.as_scanned, settings.points, settings.method
    flat, steps = kept.result(_page_and_steps, *shape, aside=(clock,))
    if on_step is not None:
        for step in steps:
            on_step(*step)
    return flat


def _page_and_steps(page: Prepared, points: int, method: Method, clock: Clock) -> tuple[Unrolled, list[Step]]:
    """The flat page, and what a watcher of its flattening sees."""
    steps = list[Step]()
    return page.unroll(Settings(points=points, method=method), clock, lambda *step: steps.append(step)), steps


def rotated(page: Unrolled, degrees: float) -> Unrolled:
    """The flat page turned clockwise about its origin."""
    if degrees == 0.0:
        return page
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[cos, -sin], [sin, cos]])
    coarse, fine = (replace(mesh, flat=mesh.flat @ turn) for mesh in (page.coarse, page.fine))
    return replace(page, coarse=coarse, fine=fine)


def square_to_picture(flat: FlatMesh) -> FlatMesh:
    """Rotate a rectangular flat mesh about its centroid, its sides parallel to the axes."""
    turn, centre = squaring(flat)
    return replace(flat, flat=(flat.flat - centre) @ turn.T + centre)


def upright_as_textured(unrolled: Unrolled) -> Unrolled:
    """Rotate the flat page to its image's upright, by right angles if rectangular.

    An image of one chart shows the page upright, and so do charts that were packed as they lie on it; of an atlas with
    charts in every rotation the page stays as it is.
    """
    fine = unrolled.fine
    if fine.texcoords is None or fine.texture is None or "oversampling" in fine.provenance:
        return unrolled
    flat, chart = ((part - part.mean(axis=0)) @ [1.0, 1.0j] for part in (fine.flat, fine.texcoords * [1.0, -1.0]))
    overlap = np.vdot(flat, chart)
    # One chart explains most of the variance.
    if abs(overlap) ** 2 < MAJORITY * (np.linalg.norm(flat) * np.linalg.norm(chart)) ** 2:
        return unrolled
    angle = float(np.angle(overlap))
    area = float(fine.areas.sum())
    if has_straight_sides(fine.flat[fine.topology.border], area):
        angle = round(angle / (np.pi / 2)) * np.pi / 2
    if angle == 0.0:
        return unrolled
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    coarse, turned = (replace(mesh, flat=mesh.flat @ turn) for mesh in (unrolled.coarse, fine))
    return replace(unrolled, coarse=turned if unrolled.coarse is fine else coarse, fine=turned)


def squaring(flat: FlatMesh) -> tuple[Floats, Floats]:
    """Return the rotation (2, 2) that aligns a rectangular page.

    Its sides become parallel to the axes. Returns also its centre (2,) mm.
    """
    area = float(flat.areas.sum())
    return squaring_rotation(flat.flat[flat.topology.border], area), flat.flat.mean(axis=0)
