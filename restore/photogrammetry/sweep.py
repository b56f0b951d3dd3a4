"""Heights of a surface where its picture is the same in all views.

Once the cameras are known, a small patch of the surface has one unknown, how far it is out of it, where a tracked one
has two in every view: a patch of a third of the area determines it, and one on a single edge, of light as well as of
print. The height is that at which the pictures of all views are most similar (Collins, "A space-sweep approach to true
multi-image matching", CVPR 1996), free of gain and offset.
"""

from __future__ import annotations

import numba
import numpy as np

from restore.camera.brown import seen_at
from restore.camera.photo_camera import PhotoCamera
from restore.numerics.robust import MAJORITY
from restore.photogrammetry.track import FACING, Patches, Picture
from restore.runtime.threads import in_bands
from restore.scan import Floats

HALF = 4  # samples from the middle of a patch to its edge
SIDE = 2 * HALF + 1
BAND = 200  # patches at a time
MIN_VIEWS = 3
MIN_ALIKE = 0.5  # correlation of a view with the others: less has one that something hides


def sweep(
    greys: Picture, cameras: list[PhotoCamera], patches: Patches, spacing_mm: float, offsets: Floats
) -> tuple[Floats, Floats, Floats]:
    """Find heights above patches by trying offsets.

    greys: (v, h, w).
    offsets: (k,) mm, evenly spaced.
    Returns heights (n,) mm, their standard deviations (n,) mm, and the similarity (n,) of the views there; NaN where no
    height stands out.
    """
    height, width = greys.shape[1:]
    rotations = np.stack([camera.rotation for camera in cameras])
    vectors = np.stack([camera.scaled((width, height)).vector for camera in cameras])
    positions = np.stack([camera.position for camera in cameras])
    found = np.full((3, len(patches.points)), np.nan)

    def sweep_band(band: slice) -> None:
        surface = patches.points[band], patches.tangents[band], patches.normals[band]
        _sweep(greys, rotations, vectors, positions, *surface, spacing_mm, offsets, found[:, band])

    in_bands(sweep_band, len(patches.points), BAND)
    return found[0], found[1], found[2]


@numba.njit(cache=True)
def _affine(turn: Floats, camera: Floats, point: Floats, tangents: Floats, normal: Floats, spacing: float) -> Floats:
    """Return the pixel of a point and how it moves, (4, 2).

    By a sample along either tangent and by a mm out of the page.
    """
    out = np.empty((4, 2))
    out[0] = seen_at(turn, camera, point[0], point[1], point[2])
    for k in range(2):
        p = point + HALF * spacing * tangents[k]
        out[1 + k] = seen_at(turn, camera, p[0], p[1], p[2])
        out[1 + k] = (out[1 + k] - out[0]) / HALF
    p = point + normal
    out[3] = seen_at(turn, camera, p[0], p[1], p[2])
    out[3] -= out[0]
    return out


@numba.njit(cache=True)
def _patch(grey: Picture, affine: Floats, offset: float, out: Floats) -> bool:
    """Write a picture (SIDE, SIDE) of mean 0 and norm 1.

    Returns False where it is not all in the photograph.
    """
    rows, cols = grey.shape
    x0, y0 = affine[0, 0] + offset * affine[3, 0], affine[0, 1] + offset * affine[3, 1]
    total = 0.0
    for i in range(SIDE):
        for j in range(SIDE):
            x = x0 + (j - HALF) * affine[1, 0] + (i - HALF) * affine[2, 0]
            y = y0 + (j - HALF) * affine[1, 1] + (i - HALF) * affine[2, 1]
            col, row = int(x), int(y)
            if not (0 <= col < cols - 1 and 0 <= row < rows - 1):
                return False
            u, v = x - col, y - row
            top = (1.0 - u) * grey[row, col] + u * grey[row, col + 1]
            bottom = (1.0 - u) * grey[row + 1, col] + u * grey[row + 1, col + 1]
            value = (1.0 - v) * top + v * bottom
            out[i, j] = value
            total += value
    out -= total / SIDE**2
    norm = np.sqrt((out * out).sum())
    if norm <= 0.0:
        return False
    out /= norm
    return True


@numba.njit(cache=True, nogil=True)
def _sweep(
    greys: Picture, turns: Floats, cameras: Floats, positions: Floats, points: Floats, tangents: Floats,
    normals: Floats, spacing: float, offsets: Floats, found: Floats,
) -> None:  # fmt: skip
    views, count, steps = len(turns), len(points), len(offsets)
    pictures = np.zeros((steps, views, SIDE, SIDE))
    affine = np.zeros((4, 2))
    scores, used = np.zeros(steps), np.zeros(views, np.bool_)
    for i in range(count):
        for v in range(views):
            way = positions[v] - points[i]
            used[v] = (way * normals[i]).sum() > FACING * np.sqrt((way * way).sum())
            if used[v]:
                affine = _affine(turns[v], cameras[v], points[i], tangents[i], normals[i], spacing)
                for k in range(steps):
                    used[v] = used[v] and _patch(greys[v], affine, offsets[k], pictures[k, v])
        best, facing = np.int64(0), used.sum()
        for turn in range(2):
            number = used.sum()
            if number < MIN_VIEWS:
                break
            for k in range(steps):
                total = np.zeros((SIDE, SIDE))
                for v in range(views):
                    if used[v]:
                        total += pictures[k, v]
                scores[k] = ((total * total).sum() - number) / (number * (number - 1))
            best = scores.argmax()
            if turn == 0:
                total = np.zeros((SIDE, SIDE))
                for v in range(views):
                    if used[v]:
                        total += pictures[best, v]
                norm = np.sqrt((total * total).sum())
                for v in range(views):
                    if used[v]:
                        used[v] = (total * pictures[best, v]).sum() > MIN_ALIKE * norm
        number = used.sum()
        if number < max(MIN_VIEWS, MAJORITY * facing) or best == 0 or best == steps - 1:
            continue
        before, top, after = scores[best - 1], scores[best], scores[best + 1]
        bend = 2.0 * top - before - after
        if bend <= 0.0:
            continue
        step = offsets[1] - offsets[0]
        found[0, i] = offsets[best] + 0.5 * step * (after - before) / bend
        found[1, i] = step * np.sqrt(4.0 * max(1.0 - top, 1e-4) / (SIDE**2 * number * bend))
        found[2, i] = top
