"""The default method: the page whose edges are nearest to their lengths on the surface.

A start from the lengths alone (`angle_synchronisation.py`), exact where the lengths are those of a developable surface,
or a conformal one where that inverts faces; Gauss–Newton on the squared and then the absolute edge strains; repair of
faces that inverted without being folded in space.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from restore.errors import BadInput
from restore.flattening.angle_synchronisation import flat_from_lengths
from restore.flattening.conformal import flatten_conformal, unfolded
from restore.flattening.fans import angle_fans, closing_signs, face_signs
from restore.flattening.gauss_newton import ROUGHLY, least_absolute_strain, mean_strain
from restore.flattening.least_distortion import is_disc, least_distorted_page
from restore.flattening.repair import inverted_count, repaired, with_corners_mirrored
from restore.flattening.solution import Follow, Solution
from restore.mesh.measures import rms_strain
from restore.mesh.network import Network
from restore.mesh.pose import PosedSheet
from restore.scan import Floats

MOST_STRAIN = 0.03  # rms: no paper stretches so far; what does is not developable, or not a mesh of one sheet

CAP = 0.1  # of the strain of an edge that counts there: a few edges of slivers do not make a surface undevelopable


class Candidate(NamedTuple):
    """A page from one start (n, 2) mm and signs (m,) of the faces, and its mean strain."""

    start: Floats
    signs: Floats
    found: Solution
    strain: float


def flatten_isometric(posed: PosedSheet, network: Network, follow: Follow | None = None) -> Solution:
    """Flat positions (n, 2) mm of a connected sheet with its convergence; the global start counts as an iteration.

    follow(step, positions (n, 3) mm) is called with the start and with the result.
    """
    if len(network.faces) == 1:
        return Solution(triangle(network), 1)
    best = min(_candidates(posed, network), key=lambda candidate: candidate.strain)
    flat = repaired(best.found.flat, network, best.signs)
    if follow:
        for step, positions in enumerate((best.start, flat), 1):
            follow(step, np.column_stack([positions, np.zeros(len(positions))]))
    return best.found._replace(flat=flat, iterations=1 + best.found.iterations)


def triangle(network: Network) -> Floats:
    """(3, 2) mm: the one face of a network, its first corner at 0 and its second on the x axis."""
    corners = unfolded(network)[0]
    flat: Floats = np.zeros((3, 2))
    flat[network.faces[0]] = np.column_stack([corners.real, corners.imag])
    return flat


def _candidates(posed: PosedSheet, network: Network) -> Iterator[Candidate]:
    """The page from the fans; where faces are in doubt also from other signs, and from a map that inverts few faces."""
    signs = face_signs(posed.positions, network.faces)
    first = _candidate(_start(network, signs), network, signs)
    yield first
    closing = closing_signs(network.faces, network.sides, network.lengths, signs)
    if (closing != signs).any():
        yield _candidate(_start(network, closing), network, closing)
    if inverted_count(first.found.flat, network.faces, signs):
        with suppress(BadInput):  # parts that hang together by single points, or faces without an area
            yield _candidate(flatten_conformal(posed, network).flat, network, closing)


def _start(network: Network, signs: Floats) -> Floats:
    fans = angle_fans(network.faces, network.sides, network.lengths, signs)
    return flat_from_lengths(fans, network.lengths, int(network.faces.max()) + 1)


def _candidate(start: Floats, network: Network, signs: Floats) -> Candidate:
    found = with_corners_mirrored(start, network, signs, ROUGHLY)
    found = least_absolute_strain(found, network)
    strain = mean_strain(found.flat, network)
    return Candidate(start, signs, found, strain if np.isfinite(strain) else np.inf)


def flatten_least_distorted(posed: PosedSheet, network: Network, follow: Follow | None = None) -> Solution:
    """As `flatten_isometric`, and a disc that is strained by more than MOST_STRAIN the least distorted page instead."""
    found = flatten_isometric(posed, network, follow)
    strain = rms_strain(found.flat, network.edges, network.lengths, CAP)
    return least_distorted_page(posed.positions, network) if strain > MOST_STRAIN and is_disc(network) else found
