"""The default method: the page whose edges keep their surface lengths.

A start from the lengths alone (`angle_synchronisation.py`), exact where the lengths are those of a developable surface,
and two others where faces are inverted; Gauss–Newton on the squared and then the absolute edge strains; repair of faces
that inverted without being folded in space.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from restore.errors import BadInput
from restore.flattening.conformal import flatten_conformal
from restore.flattening.isometric.angle_synchronisation import flat_from_lengths
from restore.flattening.isometric.fan_orientation import closing_signs
from restore.flattening.isometric.fans import angle_fans
from restore.flattening.isometric.gauss_newton import MAX_STRAIN, least_absolute_strain, minimise_strain, strained_less
from restore.flattening.isometric.least_distortion import least_distorted_page
from restore.flattening.isometric.repair import inverted_count, opened, repaired
from restore.flattening.solution import Follow, Solution
from restore.mesh.measures import edge_strain, face_signs
from restore.mesh.network import Network, pieces
from restore.mesh.pose import PosedSheet
from restore.scan import Floats, Ints

TRIED = 4  # iterations of another start: by then it is strained less than the page that is found, or hardly ever is
CAP = 0.1  # of the strain of an edge that counts there: a few edges, of slivers or a spike, say nothing of a surface


def flatten_isometric(posed: PosedSheet, network: Network, follow: Follow | None = None) -> Solution:
    """Flatten a connected sheet by the default method.

    The global start counts as an iteration. A disc that would be strained by more than MAX_STRAIN becomes the least
    distorted page instead.
    follow: called as follow(step, positions (n, 3) mm) with the page of least squares and with the result.
    Returns flat positions (n, 2) mm with their convergence.
    """
    found, signs = _least_squares(posed, network, follow)
    again = least_absolute_strain(found, network)
    again = again._replace(flat=repaired(again.flat, network, signs))
    if network.topology.is_disc and stretched(again.flat, network.edges, network.lengths):
        again = least_distorted_page(posed.positions, network)
    if follow:
        follow(2, np.column_stack([again.flat, np.zeros(len(again.flat))]))
    return again


def flatten_by_least_squares(posed: PosedSheet, network: Network, follow: Follow | None = None) -> Solution:
    """Flatten as `flatten_isometric`, by the squared strains alone.

    It is a start for further steps.
    """
    return _least_squares(posed, network, follow)[0]


def _least_squares(posed: PosedSheet, network: Network, follow: Follow | None) -> tuple[Solution, Floats]:
    """Return the page of least squared strain, and the signs of its faces.

    The page is found near the start that misses the lengths least; the signs are (m,).
    """
    start, signs = _start(posed, network)
    found = opened(minimise_strain(start, network), network, signs)
    for other in _other_starts(posed, network):
        if not inverted_count(found.flat, network.faces, signs):
            break
        again = minimise_strain(other, network, TRIED)
        if strained_less(again.flat, found.flat, network):
            found = opened(minimise_strain(again.flat, network), network, signs)
    if follow:
        follow(1, np.column_stack([found.flat, np.zeros(len(found.flat))]))
    return found._replace(iterations=1 + found.iterations), signs


def _start(posed: PosedSheet, network: Network) -> tuple[Floats, Floats]:
    """Return the start from the lengths alone, and its face signs.

    The signs (m,) are those of the normals, or of those that `closing_signs` offers, whose start (n, 2) mm is strained
    least.
    """
    signs = face_signs(posed.positions, network.faces)
    start, tried = _start_with(network, signs), [signs]
    for closing in closing_signs(posed.positions, network, signs):
        if not any((closing == before).all() for before in tried):
            tried.append(closing)
            other = _start_with(network, closing)
            start, signs = (other, closing) if strained_less(other, start, network) else (start, signs)
    return start, signs


def _start_with(network: Network, signs: Floats) -> Floats:
    fans = angle_fans(network.faces, network.sides, network.lengths, signs)
    return flat_from_lengths(fans, network.lengths, int(network.faces.max()) + 1)


def _other_starts(posed: PosedSheet, network: Network) -> Iterator[Floats]:
    """Yield further starts (n, 2) mm: the view from above, the conformal map.

    The view from above knows nothing of faces that are folded over.
    """
    yield posed.positions[:, :2]
    with suppress(BadInput):  # parts that hang together by single points, or faces without an area
        yield flatten_conformal(posed, network).flat


def stretched(flat: Floats, edges: Ints, lengths: Floats) -> bool:
    """Return whether a page is strained by more than MAX_STRAIN rms.

    flat: (n, 2) mm.
    edges: (e, 2), of lengths (e,) mm on the surface.
    """
    strain = np.minimum(np.abs(edge_strain(flat, edges, lengths)), CAP)
    return bool((strain**2).mean() > MAX_STRAIN**2)


def least_strain_page(flat: Floats, network: Network, signs: Floats | None = None) -> Solution:
    """Return the page of least strain near a start.

    It has no inverted faces where that is possible.
    flat: (n, 2) mm.
    signs: (m,), −1 for the faces that are folded in space; None when all are 1.
    """
    signs = np.ones(len(network.faces)) if signs is None else signs
    found = opened(minimise_strain(flat, network), network, signs)
    return found._replace(flat=repaired(found.flat, network, signs))


def least_absolute_page(flat: Floats, network: Network) -> Solution:
    """Return the page of least absolute strain near a start.

    A few wrong lengths hardly move it. Each connected piece is solved separately: lengths do not determine where one
    lies relative to another, and a common solution could put it anywhere.
    flat: (n, 2) mm.
    """
    whole = Solution(flat.copy(), 0)
    for piece in pieces(network):
        found = least_absolute_strain(minimise_strain(flat[piece.vertices], piece.network), piece.network)
        whole.flat[piece.vertices] = repaired(found.flat, piece.network, np.ones(len(piece.faces)))
        whole = whole.joined(found)
    return whole
