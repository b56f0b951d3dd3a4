"""Patches of a surface found again in every view, to a fraction of a pixel.

A patch is a square on the surface. Its template is the picture in the view that faces it most, resampled over the
surface; in every other view the shift on the surface that makes its picture like the template is found by the inverse
compositional method (Baker & Matthews, "Lucas-Kanade 20 years on", IJCV 56(3), 2004), free of gain and offset. Then the
mean of all views becomes the template, and all are measured again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from restore.camera.brown import seen_at
from restore.camera.photo_camera import PhotoCamera
from restore.runtime.threads import in_bands
from restore.scan import Floats, Mask

HALF = 8  # samples from the middle of a patch to its edge
PASSES = 2
BAND = 100  # patches at a time: a hundredth of a page's
STEPS = 8  # of a search: more have lost their way
FARTHEST = 12.0  # samples that a patch may be shifted by
SETTLED = 0.01  # samples
FACING = 0.25  # cosine of 75°: flatter, a patch is too short to measure
MIN_SIMILAR = 0.75  # correlation: text on the page to a shadow's edge has less
MIN_SIGMA_PX = 0.02  # standard deviation of a place: less is not to be had of interpolated pixels
MIN_VIEWS = 2  # that determine a point: a side that stands upright is seen by half of the cameras, or fewer

Picture = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Patches:
    """Places on a surface.

    points: (n, 3) mm.
    tangents: (n, 2, 3).
    normals: (n, 3).
    curvatures: (n, 3) 1/mm.
    """

    points: Floats
    tangents: Floats
    normals: Floats
    curvatures: Floats


@dataclass(frozen=True, eq=False)
class Tracked:
    """Where patches are seen.

    pixels      (v, n, 2), NaN where a patch was not found.
    similarity  (v, n) correlation with the template, 0 where it was not found.
    sigma_mm    (v, n) standard deviation of the shift on the surface that the noise leaves.
    """

    pixels: Floats
    similarity: Floats
    sigma_mm: Floats

    def found(self, similarity: float, sigma_mm: float) -> Mask:
        """Return the patches (v, n) similar and certain enough, in MIN_VIEWS views or more."""
        good = (self.similarity > similarity) & (self.sigma_mm < sigma_mm)
        return np.asarray(good & (good.sum(axis=0) >= MIN_VIEWS))


def track(greys: Picture, cameras: list[PhotoCamera], patches: Patches, spacing_mm: float) -> Tracked:
    """Find patches in photographs by their cameras.

    greys: (v, h, w), may be smaller copies of what the cameras took: all pixels are those of the cameras.
    spacing_mm: of samples on the surface.
    """
    height, width = greys.shape[1:]
    rotations = np.stack([camera.rotation for camera in cameras])
    vectors = np.stack([camera.scaled((width, height)).vector for camera in cameras])
    positions = np.stack([camera.position for camera in cameras])
    count = len(patches.points)
    pixels = np.full((len(cameras), count, 2), np.nan)
    similarity, sigma = np.zeros((len(cameras), count)), np.full((len(cameras), count), np.inf)

    def track_band(band: slice) -> None:
        surface = patches.points[band], patches.tangents[band], patches.normals[band], patches.curvatures[band]
        found = pixels[:, band], similarity[:, band], sigma[:, band]
        _track(greys, rotations, vectors, positions, *surface, spacing_mm, *found)

    in_bands(track_band, count, BAND)
    ratio = cameras[0].size[0] / width
    return Tracked((pixels + 0.5) * ratio - 0.5, similarity, sigma)


@numba.njit(cache=True)
def _on_surface(point: Floats, tangents: Floats, normal: Floats, bend: Floats, a: float, b: float) -> Floats:
    rise = 0.5 * (bend[0] * a * a + 2.0 * bend[1] * a * b + bend[2] * b * b)
    return point + a * tangents[0] + b * tangents[1] + rise * normal


@numba.njit(cache=True)
def _between(s: float, before: float, middle: float, after: float) -> float:
    """The quadratic at s from -1 to 1 that has three values at -1, 0 and 1."""
    return middle + 0.5 * s * (after - before + s * (after - 2.0 * middle + before))


@numba.njit(cache=True)
def _sample(
    grey: Picture, turn: Floats, camera: Floats, point: Floats, tangents: Floats, normal: Floats, bend: Floats,
    shift: Floats, spacing: float, out: Floats,
) -> bool:  # fmt: skip
    """Write the picture (17, 17) of a patch; False where it is not all in the photograph.

    The pixels are interpolated quadratically between nine that are projected.
    """
    knots = np.empty((3, 3, 2))
    rows, cols = grey.shape
    for i in range(3):
        for j in range(3):
            a, b = shift[0] + (j - 1) * HALF * spacing, shift[1] + (i - 1) * HALF * spacing
            p = _on_surface(point, tangents, normal, bend, a, b)
            knots[i, j, 0], knots[i, j, 1] = seen_at(turn, camera, p[0], p[1], p[2])
            if not (1 < knots[i, j, 0] < cols - 3 and 1 < knots[i, j, 1] < rows - 3):
                return False
    across = np.empty((3, 2))
    for i in range(-HALF, HALF + 1):
        s = i / HALF
        for n in range(3):
            for d in range(2):
                across[n, d] = _between(s, knots[0, n, d], knots[1, n, d], knots[2, n, d])
        for j in range(-HALF, HALF + 1):
            t = j / HALF
            x = _between(t, across[0, 0], across[1, 0], across[2, 0])
            y = _between(t, across[0, 1], across[1, 1], across[2, 1])
            col, row = int(x), int(y)
            if not (0 <= col < cols - 1 and 0 <= row < rows - 1):
                return False
            u, v = x - col, y - row
            top = (1.0 - u) * grey[row, col] + u * grey[row, col + 1]
            bottom = (1.0 - u) * grey[row + 1, col] + u * grey[row + 1, col + 1]
            out[i + HALF, j + HALF] = (1.0 - v) * top + v * bottom
    return True


@numba.njit(cache=True)
def _slopes(template: Floats, spacing: float, slopes: Floats) -> tuple[float, float, float, float, float]:
    """Write the gradient of a template inside its rim.

    Returns its mean, contrast, and structure tensor xx, xy, yy.
    """
    side = 2 * HALF + 1
    total, xx, xy, yy = 0.0, 0.0, 0.0, 0.0
    for i in range(1, side - 1):
        for j in range(1, side - 1):
            gx = (template[i, j + 1] - template[i, j - 1]) / (2.0 * spacing)
            gy = (template[i + 1, j] - template[i - 1, j]) / (2.0 * spacing)
            slopes[i, j, 0], slopes[i, j, 1] = gx, gy
            xx, xy, yy = xx + gx * gx, xy + gx * gy, yy + gy * gy
            total += template[i, j]
    mean = total / (side - 2) ** 2
    contrast = 0.0
    for i in range(1, side - 1):
        for j in range(1, side - 1):
            contrast += (template[i, j] - mean) ** 2
    return mean, contrast, xx, xy, yy


@numba.njit(cache=True)
def _search(
    template: Floats, slopes: Floats, facts: tuple[float, float, float, float, float], grey: Picture, turn: Floats,
    camera: Floats, point: Floats, tangents: Floats, normal: Floats, bend: Floats, spacing: float, shift: Floats,
    buffer: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Move a shift (2,) mm until a view is like the template.

    Returns correlation and standard deviation, mm.
    """
    mean, contrast, xx, xy, yy = facts
    determinant = xx * yy - xy * xy
    least = 0.5 * (xx + yy) - np.sqrt(max(0.25 * (xx - yy) ** 2 + xy * xy, 0.0))
    if least <= 1e-9 or contrast <= 0.0 or determinant <= 0.0:
        return 0.0, np.inf
    side = 2 * HALF + 1
    count = (side - 2) ** 2
    likeness, rest = 0.0, np.inf
    for _ in range(STEPS):
        if not _sample(grey, turn, camera, point, tangents, normal, bend, shift, spacing, buffer):
            return 0.0, np.inf
        level = 0.0
        for i in range(1, side - 1):
            for j in range(1, side - 1):
                level += buffer[i, j]
        level /= count
        own, common = 0.0, 0.0
        for i in range(1, side - 1):
            for j in range(1, side - 1):
                own += (buffer[i, j] - level) ** 2
                common += (buffer[i, j] - level) * (template[i, j] - mean)
        if own <= 0.0 or common <= 0.0:
            return 0.0, np.inf
        likeness, gain = common / np.sqrt(own * contrast), common / own
        bx, by, rest = 0.0, 0.0, 0.0
        for i in range(1, side - 1):
            for j in range(1, side - 1):
                error = gain * (buffer[i, j] - level) - (template[i, j] - mean)
                bx, by, rest = bx + slopes[i, j, 0] * error, by + slopes[i, j, 1] * error, rest + error * error
        dx, dy = (yy * bx - xy * by) / determinant, (xx * by - xy * bx) / determinant
        shift[0] -= dx
        shift[1] -= dy
        if not abs(shift[0]) + abs(shift[1]) < FARTHEST * spacing:
            return 0.0, np.inf
        if abs(dx) + abs(dy) < SETTLED * spacing:
            break
    return likeness, np.sqrt(rest / count / least)


@numba.njit(cache=True, nogil=True)
def _track(
    greys: Picture, turns: Floats, cameras: Floats, positions: Floats, points: Floats, tangents: Floats,
    normals: Floats, bends: Floats, spacing: float, pixels: Floats, similarity: Floats, sigma: Floats,
) -> None:  # fmt: skip
    """Write pixels (v, n, 2), similarity and sigma (v, n) of patches."""
    views, count, side = len(turns), len(points), 2 * HALF + 1
    for i in range(count):
        template, buffer = np.zeros((side, side)), np.zeros((side, side))
        total, slopes = np.zeros((side, side)), np.zeros((side, side, 2))
        shifts, facing = np.zeros((views, 2)), np.zeros(views)
        best, chosen = FACING, -1
        for v in range(views):
            way = positions[v] - points[i]
            facing[v] = (way * normals[i]).sum() / np.sqrt((way * way).sum())
            if facing[v] > best and _sample(
                greys[v], turns[v], cameras[v], points[i], tangents[i], normals[i], bends[i], shifts[v], spacing, buffer
            ):
                best, chosen = facing[v], v
                template[:] = buffer
        if chosen < 0:
            continue
        for turn in range(PASSES):
            facts = _slopes(template, spacing, slopes)
            total[:] = 0.0
            used = 0
            for v in range(views):
                if facing[v] <= FACING:
                    continue
                similarity[v, i], sigma[v, i] = _search(
                    template, slopes, facts, greys[v], turns[v], cameras[v], points[i], tangents[i], normals[i],
                    bends[i], spacing, shifts[v], buffer,
                )  # fmt: skip
                if similarity[v, i] < 0.5:
                    shifts[v] = 0.0
                elif turn < PASSES - 1:
                    total += (buffer - buffer.mean()) / (buffer.std() + 1e-9)
                    used += 1
            if turn < PASSES - 1 and used >= MIN_VIEWS:
                template[:] = total / used
        for v in range(views):
            if similarity[v, i] > 0.0:
                p = _on_surface(points[i], tangents[i], normals[i], bends[i], shifts[v, 0], shifts[v, 1])
                pixels[v, i, 0], pixels[v, i, 1] = seen_at(turns[v], cameras[v], p[0], p[1], p[2])
