"""Measure how places of a page move with other noise, lattices and windows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from restore.flattening.isometric.page import least_absolute_page
from restore.mesh.network import Network, make_network
from restore.mesh.topology import Topology
from restore.prepared.refine import interpolate_flat_positions, lattice_over, stride_of, subdivide
from restore.range_image.facets.facet_model import WIDE_RADIUS
from restore.range_image.facets.sheet import PageOnGrid, Sheet
from restore.range_image.fit_sheet import fit_again, laser_signal, measured_inverse_depth
from restore.scan import Floats
from restore.uncertainty.noise import Noise, draw_noise, estimate_noise

PROBES = 16  # realisations of the noise: their standard deviation is known to 18 %
PROBE_STRIDE = 4  # samples, of the lattice that probes are solved on: noise moves pages as smoothly as that
COARSER = (1, 2)  # samples by which cells of the lattices that the page is compared with are wider than its own
WIDER_RADIUS = WIDE_RADIUS + 1  # samples, of the wider windows
# Of what wider creases change, the error at creases as they are. Sides end one sample before a crease, or two: an error
# that grows with the distance would be all of it, one that grows with its square a third.
AT_CREASES = 0.5


@dataclass(frozen=True, eq=False)
class Solved:
    """A lattice over a sheet, its network, and its flat positions (n, 2) mm."""

    nodes: Floats
    network: Network
    flat: Floats


@dataclass(frozen=True, eq=False)
class Displacements:
    """Hold fields (n, 2) mm over n places of a page, without rigid parts, and the noise.

    noise    (PROBES, n, 2).
    lattices the error of the page's lattice, estimated once with each of COARSER.
    window   what wider windows change.
    creases  the error at creases, where the gutter of a book is one: (n, 2), by what wider ones change.
    """

    noise: Floats
    lattices: Floats
    window: Floats
    creases: Floats
    model: Noise


def displacements(sheet: Sheet, page: PageOnGrid, places: Floats, rng: np.random.Generator) -> Displacements:
    """Displace a flat page of a sheet; places (n, 2) are grid positions."""
    depth, signal = measured_inverse_depth(sheet.scan.points, sheet.measured), laser_signal(sheet.scan)
    model = estimate_noise(sheet, depth, signal)
    base = solve_lattice(sheet, page, PROBE_STRIDE)
    before = _at(sheet, base.nodes, base.network.topology, base.flat, places)

    def moved(inverse_depth: Floats, radius: int = WIDE_RADIUS, *, wide_creases: bool = False) -> Floats:
        again = solve_again(base, fit_again(sheet, inverse_depth, signal, radius, wide_creases=wide_creases))
        return without_rigid_part(_at(sheet, base.nodes, base.network.topology, again, places), before)

    facets = sheet.planes[..., 0]
    drawn = (np.where(sheet.measured, facets + draw_noise(model, rng), np.nan) for _ in range(PROBES))
    noise = np.stack([moved(one) for one in drawn])
    lattices = np.stack(list(_lattice_errors(sheet, page, places)))
    creases = AT_CREASES * moved(depth, wide_creases=True)
    return Displacements(noise, lattices, moved(depth, WIDER_RADIUS), creases, model)


def solve_lattice(sheet: Sheet, page: PageOnGrid, stride: int) -> Solved:
    """Solve for the page of least strain on a lattice of a stride, near a flat page."""
    nodes, faces = lattice_over(sheet, stride)
    topology = Topology(faces)
    network = make_network(sheet.points(nodes), topology, sheet.lengths(nodes, topology.edges))
    start = interpolate_flat_positions(sheet.inside.shape, page.nodes, page.faces, page.flat, nodes)
    return Solved(nodes, network, least_absolute_page(start, network).flat)


def solve_again(base: Solved, sheet: Sheet) -> Floats:
    """Return flat positions (n, 2) mm of a lattice with the lengths of another sheet."""
    topology = base.network.topology
    lengths = sheet.lengths(base.nodes, topology.edges)
    return least_absolute_page(base.flat, make_network(sheet.points(base.nodes), topology, lengths)).flat


def _lattice_errors(sheet: Sheet, page: PageOnGrid, places: Floats) -> Iterator[Floats]:
    """Yield the error (n, 2) mm of the page's lattice by each of the coarser ones.

    Errors of interpolation grow with the square of the stride (Richardson, 1911).
    """
    on_page = _at(sheet, page.nodes, page.topology, page.flat, places)
    own = stride_of(sheet.inside)
    for stride in (own + more for more in COARSER):
        other = solve_lattice(sheet, page, stride)
        split = subdivide(sheet, PageOnGrid(other.flat, other.network.faces, other.nodes))
        moved = without_rigid_part(_at(sheet, split.nodes, split.topology, split.flat, places), on_page)
        yield moved * (own**2 / (stride**2 - own**2))


def _at(sheet: Sheet, nodes: Floats, topology: Topology, flat: Floats, places: Floats) -> Floats:
    """Interpolate flat positions (k, 2) mm at nodes (k, 2) to places (n, 2)."""
    return interpolate_flat_positions(sheet.inside.shape, nodes, topology.faces, flat, places)


def without_rigid_part(moved: Floats, places: Floats) -> Floats:
    """Return by what places (n, 2) mm are moved after the best rigid motion, (n, 2) mm."""
    a, b = moved - moved.mean(axis=0), places - places.mean(axis=0)
    across, _, along = np.linalg.svd(a.T @ b)
    turn = across @ np.diag([1.0, np.sign(np.linalg.det(across @ along))]) @ along
    return np.asarray(a @ turn - b)
