"""The flat page: the flattened mesh, and the painted page with its report."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from restore.findings import Finding
from restore.mesh.measures import edge_strain, face_normals, face_signs, flipped_faces, norms, signed_areas
from restore.mesh.strain import face_strain
from restore.mesh.topology import Topology
from restore.report import ConvergenceReport, Report
from restore.runtime.rows import Rows
from restore.scan import Bytes, Floats, Ints, Mask, SurfaceMesh


@dataclass(frozen=True, eq=False)
class FlatMesh(SurfaceMesh):
    """A surface mesh with its flat positions on the page.

    flat       (n, 2) float64 mm, x right, y up, never mirrored, upright as in the scanner's view.
    iterations  iterations or time steps that the flattening took.
    lengths    (e,) float64 mm: rest lengths along the surface, in the order of `edges`.
    residual   rms strain that a single vertex could still be relieved of when the solver stopped.
    converged  whether the solver reached its tolerance on every piece.

    >>> corners = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0], [0.0, 10.0, 0.0]])
    >>> page = flatten(SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])))
    >>> page.edges.tolist(), page.lengths.round(1).tolist()
    ([[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]], [10.0, 14.1, 10.0, 10.0, 10.0])
    """

    flat: Floats = field(default_factory=lambda: np.empty((0, 2)))
    iterations: int = 0
    lengths: Floats = field(default_factory=lambda: np.empty(0))
    residual: float = 0.0
    converged: bool = True

    @cached_property
    def topology(self) -> Topology:
        """Which faces meet in which edges."""
        return Topology(self.faces)

    @property
    def edges(self) -> Ints:
        """Return the edges (e, 2) of the faces, each once, ascending, smaller vertex first."""
        return self.topology.edges

    @cached_property
    def areas(self) -> Floats:
        """Return the signed areas (m,) mm² of the faces on the page, negative where flipped."""
        return signed_areas(self.flat, self.faces)

    @cached_property
    def surface_areas(self) -> Floats:
        """Return the areas (m,) mm² of the faces in space."""
        return 0.5 * norms(face_normals(self.vertices, self.faces))

    @cached_property
    def signs(self) -> Floats:
        """Return −1 for faces that are folded over in space, else 1, (m,)."""
        return face_signs(self.vertices, self.faces)

    @cached_property
    def strain(self) -> Floats:
        """Return the relative change of length (e,) of the edges on the page."""
        return edge_strain(self.flat, self.edges, self.lengths)

    @cached_property
    def face_strain(self) -> Floats:
        """Return the stretch and shear of the faces, (m, 2)."""
        return face_strain(self.flat, self.faces, self.edges, self.lengths)

    @cached_property
    def flipped(self) -> int:
        """Count the faces that lie upside down on the page."""
        return flipped_faces(self.flat, self.faces)

    @property
    def convergence(self) -> ConvergenceReport:
        """`residual` and `converged` by their names."""
        return {"residual": self.residual, "converged": self.converged}

    @classmethod
    def of(cls, mesh: SurfaceMesh, flat: Floats, lengths: Floats, iterations: int, **convergence: Any) -> Self:
        """Make a flat mesh from a surface mesh.

        flat: (n, 2) mm.
        lengths: (e,) mm, rest lengths.
        convergence: `residual` and `converged` of the solver.
        """
        surface: dict[str, Any] = {name: getattr(mesh, name) for name in SurfaceMesh.__dataclass_fields__}
        return cls(**surface, flat=flat, lengths=lengths, iterations=iterations, **convergence)


@dataclass(frozen=True, eq=False)
class RestoredPage:
    """The flat page, painted true to scale.

    pictures  arrays (h, w, …) over its pixels: name → rows, which are drawn where they are needed. Each is a property
              as well, that draws the whole when it is first read.
    dpi       one inch of paper is `dpi` pixels.
    flat      the flattened mesh of the requested number of points.
    fine      the finer mesh that maps the picture to the page, the same when the scan has no grid.
    report    a plain dictionary of sizes, strain, findings and times: see `restore.report`.
    findings  what is to be reported of the page; `report["findings"]` has the same as JSON values.
    trimmed   pixels that a crop took away at the left, top, right and bottom side, negative where it added some.

    >>> corners = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
    >>> page = restore(SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), Settings(dpi=30))
    >>> [round(side) for side in page.report["page_mm"]], [found.code for found in page.findings]
    ([100, 50], ['no_colour'])
    """

    pictures: Mapping[str, Rows]
    dpi: float
    flat: FlatMesh
    fine: FlatMesh
    report: Report
    findings: tuple[Finding, ...] = ()
    trimmed: tuple[int, int, int, int] = (0, 0, 0, 0)

    @cached_property
    def image(self) -> Bytes:
        """The page, (h, w, 3) uint8 RGB."""
        return self.pictures["image"]()

    @cached_property
    def mask(self) -> Mask:
        """Where the camera saw the page, its shape measured or filled in, (h, w) bool."""
        return self.pictures["mask"]()

    @cached_property
    def page_map(self) -> NDArray[np.float32]:
        """The texture pixel of each page pixel, (h, w, 2) float32, NaN outside the page."""
        return self.pictures["page_map"]()

    @cached_property
    def master(self) -> Bytes:
        """The page with its shading, (h, w, 3) uint8 RGB."""
        return self.pictures["master"]()

    @cached_property
    def coverage(self) -> Bytes:
        """The kind of each pixel, (h, w) uint8: values of `CoverageClass`."""
        return self.pictures["coverage"]()

    @cached_property
    def page_source(self) -> Bytes | None:
        """The picture that page_map's pixel is in, (h, w) uint8, with photographs; None without.

        0 is the texture, k the k-th photograph, 255 outside the page.
        """
        return self._optional("page_source")

    @cached_property
    def uncertainty(self) -> NDArray[np.float32] | None:
        """Standard deviation of each pixel's place, (h, w) float32 mm along either page axis.

        None where it was not asked for, or cannot be estimated.
        """
        return self._optional("uncertainty")

    @cached_property
    def uncropped(self) -> Bytes | None:
        """The master without crop and with what was removed by hand, or None.

        Its own (h, w, 3) uint8 RGB.
        """
        return self._optional("uncropped")

    def _optional(self, name: str) -> NDArray[Any] | None:
        return self.pictures[name]() if name in self.pictures else None

    def by_rows(self, name: str) -> Rows:
        """Return the rows of a picture; those of the whole, where that is drawn already."""
        return Rows.of(vars(self)[name]) if name in vars(self) else self.pictures[name]

    def with_pictures(self, **pictures: NDArray[Any]) -> Self:
        """Return the page with other arrays (h, w, …) for some of its pictures."""
        return replace(self, pictures={**self.pictures, **{name: Rows.of(one) for name, one in pictures.items()}})

    def changed_pictures(self, change: Callable[[str, NDArray[Any]], NDArray[Any]]) -> Self:
        """Return the page with all its pictures after change(name, array (h, w, …))."""
        changed = {name: np.ascontiguousarray(change(name, getattr(self, name))) for name in self.pictures}
        return self.with_pictures(**changed)

    def changed_meshes(self, change: Callable[[FlatMesh], FlatMesh]) -> Self:
        """Return the page with its meshes after a change; they stay one where they are one."""
        flat = change(self.flat)
        return replace(self, flat=flat, fine=flat if self.fine is self.flat else change(self.fine))
