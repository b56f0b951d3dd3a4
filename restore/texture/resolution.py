"""What a picture of a page resolves, by the edges of print and paper.

Windows that hold one edge and flat light on either side are found; the edge is located in each to a fraction of a pixel
and the light of all, from 0 to 1, is sorted by the distance to it: the edge spread function, in quarters of a pixel.
The spectrum of its slope is the modulation transfer function, as ISO 12233 has it for a slanted edge; MTF50 is where
that falls to a half. The effective resolution is 2 · MTF50: the pixels per inch that two pixels a period make of it, at
most those that the picture has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from restore.numerics.srgb import LINEAR
from restore.report import ResolutionReport
from restore.scan import Bytes, Floats, Ints, Mask

MM_PER_INCH = 25.4
HALF = 5  # pixels of a window from its middle, across an edge and along it
PLATEAU = 3  # pixels from the edge: farther off, the light of a sharp edge is flat
GRID = 8  # pixels: of so large a square the steepest pixel may be an edge
TILE = 1024  # pixels of a side that are searched at once
MAX_EDGES = 400
MISFIT = 0.06  # rms, of the step: a super-resolved edge rings by as much, over a range of four times that
MIN_STEP = 0.06  # of full light: several times the noise
HIGH = 0.5  # of the step that nine in ten do not exceed: ink and table next to paper, not shade or relief
MIN_EDGES = 8  # windows
STEPS = 7  # of Gauss and Newton: they settle in five or six
BINS = 4  # to a pixel
COPY_LIMIT = 0.3  # cycles per pixel of a smaller copy: edges with more are as sharp as the copy, not the picture
LEVELS = 5  # halvings: edges that are spread over up to 80 pixels
NO_EDGES = "neither the print nor the outline of the page has enough straight, isolated edges to measure it"
NO_PICTURE = "the scan has no colour image"

Light = NDArray[np.float32]


@dataclass(frozen=True)
class Resolution:
    """Resolution of a picture on the page.

    sampling_ppi: its pixels per inch of paper, 0 without a picture.
    edges: their MTF50, cycles per pixel, None where it has too few to measure it; or a function that measures it.
    """

    sampling_ppi: float
    edges: float | Callable[[], float | None] | None = None

    @cached_property
    def mtf50(self) -> float | None:
        """The cycles per pixel at which its edges have half their contrast."""
        return self.edges() if callable(self.edges) else self.edges

    @property
    def resolved_ppi(self) -> float | None:
        """Return 2 · MTF50 per inch of paper, at most the sampling.

        0 without a picture, None where it cannot be measured.
        """
        if not self.sampling_ppi:
            return 0.0
        return None if self.mtf50 is None else self.sampling_ppi * resolved_fraction(self.mtf50)

    def described(self) -> ResolutionReport:
        """Entries of a report."""
        found: ResolutionReport = {
            "resolved_ppi": self.resolved_ppi,
            "sampling_ppi": self.sampling_ppi,
            "mtf50_per_mm": None if self.mtf50 is None else self.mtf50 * self.sampling_ppi / MM_PER_INCH,
        }
        if self.mtf50 is not None and self.sampling_ppi:
            return found
        return {**found, "resolved_ppi_unknown": NO_EDGES if self.sampling_ppi else NO_PICTURE}


def resolved_fraction(mtf50: float | None) -> float:
    """Return the effective pixels, at most 1, to a pixel of a picture.

    Its MTF50 is in cycles per pixel; 1 where that is unknown.
    """
    return 1.0 if mtf50 is None else min(1.0, 2.0 * mtf50)


def print_or_outline_mtf50(picture: Bytes, page: Mask, rim: float = 0.0) -> float | None:
    """Return the MTF50 of a picture's print, or of the page's outline.

    The outline counts where print has too few edges; it may lie higher or lower than the print and have a shadow.
    picture: (h, w, 3).
    page: (h, w), True where it shows the page.
    rim: pixels to which the outline of the page is known.
    Returns cycles per pixel, None where both have too few edges.
    """
    window = np.ones((2 * (HALF + ceil(rim)) + 1,) * 2, np.uint8)
    inner, outer = (morph(page.astype(np.uint8), window) > 0 for morph in (cv2.erode, cv2.dilate))
    found = edge_mtf50(picture, inner)
    return edge_mtf50(picture, outer) if found is None else found


def edge_mtf50(picture: Bytes, mask: Mask) -> float | None:
    """Return the MTF50 of a picture in cycles per pixel.

    Edges too wide for a window are measured in smaller copies, corrected for their averaging.
    picture: (h, w, 3).
    mask: (h, w), where to measure.
    Returns None when fewer than MIN_EDGES edges are found.
    """
    light = LINEAR[cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)]
    inside = mask.astype(np.uint8)
    for level in range(LEVELS):
        count, distance, fraction = _edges(light, inside > 0)
        if count >= MIN_EDGES:
            cycles = mtf50_of(distance, fraction, HALF, level)
            if level == 0 or cycles < COPY_LIMIT:
                return cycles / 2**level
        size = light.shape[1] // 2, light.shape[0] // 2
        if min(size) < 4 * HALF:
            break
        light = np.asarray(cv2.resize(light[: 2 * size[1], : 2 * size[0]], size, interpolation=cv2.INTER_AREA))
        inside = np.asarray(cv2.resize(inside, size, interpolation=cv2.INTER_NEAREST))
    return None


def mtf50_of(distance: Floats, fraction: Floats, reach: float, level: int = 0) -> float:
    """Return the frequency, cycles per pixel, at which an edge's spectrum falls to half.

    distance, fraction: (n,), pixels from the edge, up to `reach`, and the light there.
    level: halvings of the picture, each over two pixels.
    """
    half = int(reach * BINS)
    number = np.rint(distance * BINS).astype(int) + half
    kept = (number >= 0) & (number <= 2 * half)
    count = np.bincount(number[kept], minlength=2 * half + 1)
    total = np.bincount(number[kept], fraction[kept], 2 * half + 1)
    filled = np.flatnonzero(count)
    profile = np.interp(np.arange(2 * half + 1), filled, total[filled] / count[filled])
    spread = np.diff(profile) * _tapered(2 * half, 1 - PLATEAU / reach)
    frequency = np.fft.rfftfreq(16 * len(spread), 1.0 / BINS)
    mtf = np.abs(np.fft.rfft(spread, 16 * len(spread)))
    mtf = mtf / mtf[0] / np.sinc(frequency / BINS) ** 2  # of the differences and of the bins
    for halving in range(level):
        mtf /= np.maximum(np.abs(np.cos(np.pi * frequency / 2 ** (level - halving))), np.finfo(float).eps)
    below = int(np.argmax(np.append(mtf, 0.0) < 0.5))
    if below == len(mtf):
        return float(frequency[-1])
    return float(np.interp(0.5, [mtf[below], mtf[below - 1]], [frequency[below], frequency[below - 1]]))


def _tapered(count: int, fraction: float) -> Floats:
    """Return Tukey's window, weights (count,).

    1 in the centre, and over half a `fraction` at either end a cosine down to 0. The import of scipy.signal, which has
    it, takes a third of the time that this package takes to start.
    """
    from_end = np.arange(count) / (fraction * (count - 1) / 2)
    return 0.5 - 0.5 * np.cos(np.pi * np.clip(np.minimum(from_end, from_end[::-1]), 0.0, 1.0))


def _edges(light: Light, inside: Mask) -> tuple[int, Floats, Floats]:
    """Return how many edges there are, with distances and light (k,) of the pixels round them.

    Light is 0 and 1 on either side.
    """
    places, turn, rise = _candidates(light, inside)
    high = rise >= HIGH * np.quantile(rise, 0.9) if len(rise) else rise > 0
    places, turn, rise = places[high], turn[high], rise[high]
    some = np.linspace(0, len(places) - 1, min(len(places), MAX_EDGES)).astype(int)
    return _fitted(light, places[some], turn[some])


def _candidates(light: Light, inside: Mask) -> tuple[Ints, Floats, Floats]:
    """Return pixels (n, 2) of isolated steps, their direction and height.

    As row and column, where a step crosses a window that is flat on either side of it; the direction in which its light
    rises in radians.
    """
    found = [
        _isolated(light, *_steepest(light, inside, (top, left)))
        for top in range(0, light.shape[0], TILE)
        for left in range(0, light.shape[1], TILE)
        if inside[top : top + TILE, left : left + TILE].any()
    ]
    places, turn, rise = (np.concatenate(parts) for parts in zip(*found, strict=True)) if found else _none()
    return places, turn, rise


def _none() -> tuple[Ints, Floats, Floats]:
    return np.empty((0, 2), int), np.empty(0), np.empty(0)


def _steepest(light: Light, inside: Mask, corner: tuple[int, int]) -> tuple[Ints, Floats]:
    """Return the steepest pixels (n, 2) of a tile's squares, and where their light rises."""
    reach = 2 * HALF + 1
    rows, cols = (
        slice(max(start, reach), min(start + TILE, size - reach))
        for start, size in zip(corner, light.shape, strict=True)
    )
    if rows.stop - rows.start < GRID or cols.stop - cols.start < GRID:
        return np.empty((0, 2), int), np.empty(0)
    part = light[rows, cols]
    gx, gy = (cv2.Sobel(part, cv2.CV_32F, *way) / 8.0 for way in ((1, 0), (0, 1)))
    steep = np.hypot(gx, gy) * inside[rows, cols]
    high, wide = (side // GRID for side in part.shape)
    squares = steep[: high * GRID, : wide * GRID].reshape(high, GRID, wide, GRID).swapaxes(1, 2).reshape(-1, GRID**2)
    best = squares.argmax(axis=1)
    number = np.flatnonzero(squares[np.arange(len(squares)), best] > MIN_STEP / (2 * HALF))
    row = number // wide * GRID + best[number] // GRID
    col = number % wide * GRID + best[number] % GRID
    return np.stack([row + rows.start, col + cols.start], axis=1), np.arctan2(gy[row, col], gx[row, col])


def _isolated(light: Light, places: Ints, turn: Floats) -> tuple[Ints, Floats, Floats]:
    """Return places (n, 2) with flat light on both sides, their direction and step height."""
    along, across = np.meshgrid(np.linspace(-HALF, HALF, 5), np.arange(PLATEAU, HALF + 1))
    sides = []
    for sign in (-1, 1):
        x = np.cos(turn)[:, None] * sign * across.ravel() - np.sin(turn)[:, None] * along.ravel()
        y = np.sin(turn)[:, None] * sign * across.ravel() + np.cos(turn)[:, None] * along.ravel()
        sides.append(light[places[:, :1] + np.rint(y).astype(int), places[:, 1:] + np.rint(x).astype(int)])
    low, high = sides
    rise = high.mean(axis=1) - low.mean(axis=1)
    kept = (rise > MIN_STEP) & np.all([np.ptp(side, axis=1) < 4 * MISFIT * rise for side in sides], axis=0)
    return places[kept], turn[kept], rise[kept].astype(float)


def _fitted(light: Light, places: Ints, turn: Floats) -> tuple[int, Floats, Floats]:
    """Return how many edges one step explains, with distances and light (k,) of their pixels."""
    reach = 2 * HALF
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1)
    values = light[places[:, :1] + y, places[:, 1:] + x].astype(float)
    across = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y
    along = np.cos(turn)[:, None] * y - np.sin(turn)[:, None] * x
    inside = (np.abs(across) <= HALF) & (np.abs(along) <= HALF)
    # Three pixels in four lie outside the turned window: those in it come first, and the rest is left out.
    first = np.argsort(~inside, axis=1, kind="stable")[:, : inside.sum(axis=1).max(initial=0)]
    values, across, along, inside = (np.take_along_axis(part, first, 1) for part in (values, across, along, inside))
    fit, misfit = _steps(values, across, along, inside)
    low, rise, place, lean, bow, spread = fit.T
    kept = (rise > MIN_STEP) & (misfit < MISFIT * rise) & (np.abs(place) < 2.0) & (spread < PLATEAU / 2)
    distance = across - (place[:, None] + lean[:, None] * along + bow[:, None] * along**2)
    fraction = (values - low[:, None]) / np.maximum(rise, MIN_STEP)[:, None]
    shown = inside & kept[:, None]
    return int(np.count_nonzero(kept)), distance[shown], fraction[shown]


def _steps(values: Floats, across: Floats, along: Floats, inside: Mask) -> tuple[Floats, Floats]:
    """Fit a curved step to each row of values (n, k) by Gauss and Newton.

    Returns (n, 6): low side, height, place, lean and bow of the edge, and its spread, in pixels; and the rms residual
    (n,).
    """
    count, weight = len(values), inside.astype(float)
    low = np.where(inside, values, np.inf).min(axis=1, initial=np.inf)
    rise = np.where(inside, values, -np.inf).max(axis=1, initial=-np.inf) - low
    fit = np.stack([low, rise, *np.zeros((3, count)), np.full(count, 0.7)], axis=1)
    damping = np.diag([1e-6, 1e-6, 1e-4, 1e-4, 1e-2, 1e-4])
    slopes = np.empty((*values.shape, 6))
    for _ in range(STEPS):
        error = (values - _model(fit, across, along, slopes)) * weight
        slopes *= weight[..., None]
        normal = slopes.transpose(0, 2, 1) @ slopes + damping
        change = np.linalg.solve(normal, (slopes.transpose(0, 2, 1) @ error[..., None]))[..., 0]
        fit += np.clip(change, -0.5, 0.5)
        fit[:, 5] = np.clip(fit[:, 5], 0.15, HALF)
    error = (values - _model(fit, across, along, slopes)) * weight
    return fit, np.sqrt((error**2).sum(axis=1) / weight.sum(axis=1))


def _model(fit: Floats, across: Floats, along: Floats, slopes: Floats) -> Floats:
    """Return values (n, k) of steps, and write their derivatives (n, k, 6)."""
    low, rise, place, lean, bow, spread = (fit[:, k : k + 1] for k in range(6))
    t = (across - place - lean * along - bow * along**2) / spread
    step, slope = ndtr(t), rise * np.exp(-0.5 * t * t) / (np.sqrt(2 * np.pi) * spread)
    for k, column in enumerate((1.0, step, -slope, -slope * along, -slope * along**2, -slope * t)):
        slopes[..., k] = column
    return low + rise * step
