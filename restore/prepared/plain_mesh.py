"""A page as a triangle mesh.

No single view shows it, or it is coarse, or it is interpolated from points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from restore.findings import Finding
from restore.flattening.methods import OnStep
from restore.mesh.clean import clean
from restore.page import FlatMesh
from restore.prepared.flatten import flatten
from restore.prepared.prepared import Clock, KindsOfRows, Prepared, Unrolled, square_to_picture, upright_as_textured
from restore.report import SampleReport
from restore.scan import Bytes, Floats, InterpolatedMesh, Mask, SurfaceMesh
from restore.settings import Settings
from restore.texture.coverage import Coverage, CoverageClass, distance_to
from restore.texture.page import PageMap, Painting, rasterise_on_page


@dataclass(frozen=True, eq=False)
class PlainMesh(Prepared):
    """Page with its shape given by its vertices."""

    mesh: SurfaceMesh
    is_one_shot: bool = False

    def unroll(self, settings: Settings, clock: Clock, on_step: OnStep | None = None) -> Unrolled:
        """The flat page of its cleaned mesh."""
        with clock("decimate"):
            mesh = clean(self.mesh, settings.points or len(self.mesh.vertices))
        with clock("flatten"):
            flat = square_to_picture(flatten(mesh, settings.method, on_step=on_step))
        unrolled = Unrolled(flat, flat, np.empty((0, 2)), {})
        return unrolled if self.is_one_shot else upright_as_textured(unrolled)


@dataclass(frozen=True, eq=False)
class InterpolatedPage(Prepared):
    """A page between measured points, as photographs give it; prepared as its mesh is."""

    page: Prepared
    scan: InterpolatedMesh

    def unroll(self, settings: Settings, clock: Clock, on_step: OnStep | None = None) -> Unrolled:
        """As of its mesh."""
        return self.page.unroll(settings, clock, on_step)

    @property
    def facts(self) -> SampleReport:
        """As of its mesh."""
        return self.page.facts

    @property
    def findings(self) -> tuple[Finding, ...]:
        """As of its mesh."""
        return self.page.findings

    def normals_on(self, fine: FlatMesh, dpi: float, axes: Floats) -> PageMap:
        """Return the normals (h, w, 3) of its mesh.

        axes: (3, 3).
        """
        return self.page.normals_on(fine, dpi, axes)

    def camera_centre(self, fine: FlatMesh) -> Floats | None:
        """Return the camera centre (3,) mm of its mesh."""
        return self.page.camera_centre(fine)

    def kinds_by_rows(self, fine: FlatMesh, dpi: float) -> KindsOfRows:
        """Return its mesh's coverage, INTERPOLATED beyond `reach_mm` of measured points."""
        of_mesh = self.page.kinds_by_rows(fine, dpi)
        distance = distance_to(self.scan.measured, fine.vertices)[:, None]

        def find(page: Mask, top: int) -> Bytes:
            kinds = of_mesh(page, top)
            drawn = rasterise_on_page(fine, distance, page.shape, dpi, slice(top, top + len(page)))
            near = drawn[..., 0] <= self.scan.reach_mm
            kinds[~near & (kinds == CoverageClass.MEASURED)] = CoverageClass.INTERPOLATED
            return kinds

        return find

    def findings_on(self, _painting: Painting, _coverage: Coverage, _dpi: float) -> list[Finding]:
        """None: its reconstruction has reported what is not measured."""
        return []
