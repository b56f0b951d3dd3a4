"""The page hides lamps and room from its places, and reflects their light to them.

Next to a fold bright paper lights the paper that is turned away from the lamp, by a tenth of its light and more. Paper
reflects in all directions alike, so that a place gets from the page what the parts that it sees are lit by, times how
much of its view they fill (S. K. Nayar, K. Ikeuchi, T. Kanade, "Shape from interreflections", International Journal of
Computer Vision 6(3), 1991, sec. 2). One reflection is counted; the next is a tenth again.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.sparse import csr_matrix

from restore.scan import Ints
from restore.shading.channels import as_list
from restore.shading.horizon_map import ONWARD, HorizonMap, fill_nearest, horizon_map
from restore.shading.relief import Field, Relief

PATCH = 6  # nodes across and down, 11 mm: what a patch reflects arrives spread over all that a place sees
# Of the way to the horizon: what stands before a place rises to it from somewhere on the way, and beyond it lies the
# far side, which is not seen.
WITHIN = 0.8
MIN_FRACTION = 1e-3  # of a place's view: a direction with less is left out


@dataclass(frozen=True, eq=False)
class Places:
    """Spots of the page.

    points, normals: (n, 3) mm and (n, 3), in the frame of the relief.
    openness: (n,), 0 to 1.
    nodes: (n, 2) = (col, row) in the horizon map.
    """

    points: Field
    normals: Field
    openness: Field
    nodes: Field

    def __getitem__(self, chosen: Ints | slice) -> Places:
        return Places(self.points[chosen], self.normals[chosen], self.openness[chosen], self.nodes[chosen])


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Horizon map of a page, and patches in the view of its nodes.

    patches: (p), places in the centre of each patch.
    fractions: sparse (nodes, p), 0 to 1, how much of the view of every node each patch fills.
    """

    horizon: HorizonMap
    patches: Places
    fractions: csr_matrix

    def fractions_at(self, places: Places) -> csr_matrix:
        """Return how much of the view of places each patch fills, (n, p).

        That of the nearest node, as it varies slowly.
        """
        rows, cols = self.horizon.heights.shape
        col, row = (np.clip(np.rint(places.nodes[:, k]), 0, n - 1).astype(int) for k, n in enumerate((cols, rows)))
        return self.fractions[row * cols + col]

    def reflected(self, light: Field) -> Field:
        """Return the light that nodes get from patches of reflectance 1.

        light: (p, 3), on the patches. Returns (rows, cols, 3).
        """
        return np.asarray((self.fractions @ light).reshape(*self.horizon.heights.shape, 3), dtype=np.float32)


def surroundings_of(relief: Relief) -> Surroundings:
    """Surroundings of the places of a relief."""
    horizon = horizon_map(relief)
    known = np.isfinite(horizon.normals[..., 2])
    row, col = (
        np.minimum(part.ravel() * PATCH + PATCH // 2, n - 1)
        for part, n in zip(np.indices(_patches(known.shape)), known.shape, strict=True)
    )
    normals, points, openness = (
        fill_nearest(field, known)[row, col] for field in (horizon.normals, horizon.points, horizon.openness)
    )
    nodes = np.stack([col, row], axis=1).astype(np.float32)
    return Surroundings(horizon, Places(points, normals, openness, nodes), _fractions(horizon))


def _patches(nodes: tuple[int, ...]) -> tuple[int, ...]:
    """Return rows and columns of patches for those of nodes."""
    return tuple(-(-n // PATCH) for n in nodes)


def _fractions(horizon: HorizonMap) -> csr_matrix:
    """Return how much of the view of every node each patch fills, (nodes, p)."""
    rows, cols = horizon.heights.shape
    fraction = horizon.views[1]
    row, col, way = np.nonzero(fraction > MIN_FRACTION)  # nothing where it is not known
    ahead = WITHIN * horizon.reaches[row, col, way][:, None] * ONWARD[way]
    there = [
        np.clip(np.rint(at + ahead[:, k]), 0, n - 1).astype(int) // PATCH
        for k, at, n in ((1, row, rows), (0, col, cols))
    ]
    shape = _patches((rows, cols))
    at = row * cols + col, np.ravel_multi_index(there, shape)
    return csr_matrix((fraction[row, col, way], at), shape=(rows * cols, int(np.prod(shape))))


def places_of(relief: Relief, horizon: HorizonMap) -> Places:
    """Return all cells of a relief as a list, those off the page too.

    To sort them out would take longer.
    """
    nodes = horizon.nodes(relief.points)
    openness = cv2.remap(horizon.openness, nodes, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return Places(*(as_list(field) for field in (relief.points, relief.normals, openness, nodes)))
