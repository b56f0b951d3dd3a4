"""Places the spine within a sample, where left and right surfaces meet in each row."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from restore.numerics.lines import MIN_POINTS, theil_sen
from restore.numerics.robust import MAJORITY, OUTLYING, robust_sigma
from restore.range_image.facets.facet_model import NARROW_RADIUS, WIDE_RADIUS
from restore.range_image.facets.sheet import Sheet
from restore.scan import Floats, Ints

SPAN = 2 * WIDE_RADIUS + 1  # samples of each wall that a parabola is fitted to, and rows with common ones: a facet;
# farther from the first place the walls do not meet
NEWTON_STEPS = 3  # from the crossing of parabolas to that of cubics: less than a sample in most rows


class Crease(NamedTuple):
    """The fold at the spine of an opened book.

    nodes: (n, 2) grid positions from head to tail; sigma: standard deviation of its place, samples.

    In sigma: the scatter of the rows, a gap in which nothing was measured, and how far the place depends on the curve
    by which the walls are continued. That is the same in each row, and large where a wall turns within a few samples,
    as over the edge of a block.
    """

    nodes: Floats
    sigma: float


def place_crease(sheet: Sheet, rows: Floats, cols: Floats) -> Crease | None:
    """Return the line in which two walls meet near grid positions.

    In each row the inverse depth of either wall is continued by a parabola, and the two cross within a sample. A fold
    that is straight in space is straight in the image, so a line is fitted to all crossings, or a parabola if that
    halves the residual.
    rows, cols: (n,).
    Returns None where the walls do not meet.
    """
    row = np.unique(np.rint(rows).astype(int))
    row = row[(row >= 0) & (row < sheet.inside.shape[0])]
    first = np.interp(row, rows, cols)
    found, by_cubics = _crossings(sheet, row, first)
    known = np.isfinite(found)
    if known.sum() < MIN_POINTS:
        return None
    line = _fit(row[known].astype(float), found[known])
    ends = np.linspace(row[known][0], row[known][-1], 9)
    hidden = _hidden(sheet, row[known], line.at(row[known]))
    model = float(np.median((by_cubics - found)[known]))
    sigma = np.linalg.norm([line.sigma, hidden / np.sqrt(12.0), model])
    return Crease(np.column_stack([ends, line.at(ends)]), float(sigma))


def _hidden(sheet: Sheet, row: Ints, col: Floats) -> float:
    """Return the samples at the crease that gave no range.

    In the median of rows (n,): the crease may be anywhere among them.
    """
    width = sheet.measured.shape[1]
    at = np.clip(np.rint(col).astype(int)[:, None] + np.arange(-width, width + 1), 0, width - 1)
    measured = sheet.measured[row[:, None], at]
    left, right = (np.argmax(measured[:, side], axis=1) for side in (slice(width, None, -1), slice(width, None)))
    return max(float(np.median(left + right)) - 1.0, 0.0)


class _Line(NamedTuple):
    coefficients: Floats
    sigma: float

    def at(self, row: Floats) -> Floats:
        return np.asarray(np.polyval(self.coefficients, row))


def _fit(row: Floats, col: Floats) -> _Line:
    slope, offset = theil_sen(row, col)
    residual = col - slope * row - offset
    near = np.abs(residual) <= OUTLYING * max(robust_sigma(residual), 1e-3)
    line, curve = (np.polyfit(row[near], col[near], degree) for degree in (1, 2))
    rms, bent = (float(np.sqrt(np.mean((col[near] - np.polyval(fit, row[near])) ** 2))) for fit in (line, curve))
    chosen, spread = (curve, bent) if bent < MAJORITY * rms else (line, rms)
    return _Line(np.asarray(chosen), spread / np.sqrt(max(near.sum() / SPAN, 1.0)))


def _crossings(sheet: Sheet, row: Ints, first: Floats) -> tuple[Floats, Floats]:
    """Return the columns (n,) in which both walls cross in rows (n,), near columns (n,).

    By parabolas, NaN where they do not cross; and by cubics, within the reach of these.
    """
    depth = sheet.planes[..., 0]
    middle = np.rint(first).astype(int)
    steps = NARROW_RADIUS + np.arange(SPAN)  # nearer, the narrowest facet may have mixed both walls
    walls, cubics = [], []
    for sign in (-1, 1):
        at = middle[:, None] + sign * steps
        inside = (at >= 0) & (at < depth.shape[1])
        value = depth[row[:, None], np.clip(at, 0, depth.shape[1] - 1)]
        inside &= sheet.inside[row[:, None], np.clip(at, 0, depth.shape[1] - 1)]
        value = np.where(inside.all(axis=1)[:, None], value, np.nan)
        at_steps = sign * steps.astype(float)
        walls.append(_polynomials(at_steps, value, 2))
        cubics.append(_polynomials(at_steps, value, 3))
    a, b, c = (walls[1] - walls[0]).T
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(b * b - 4 * a * c)
        roots = np.stack([2 * c / (-b - root), 2 * c / (-b + root)])
    roots = np.where(np.abs(roots) <= SPAN, roots, np.nan)
    at_first = np.where(np.isfinite(roots), np.abs(roots), np.inf).argmin(axis=0)
    crossing = roots[at_first, np.arange(len(row))]
    return middle + crossing, middle + np.clip(_root_near(crossing, cubics[1] - cubics[0]), -SPAN, SPAN)


def _root_near(at: Floats, coefficients: Floats) -> Floats:
    """Find roots (n,) of polynomials (n, 4) by Newton's method from places (n,)."""
    third, second, first, constant = coefficients.T
    for _ in range(NEWTON_STEPS):
        value = ((third * at + second) * at + first) * at + constant
        with np.errstate(invalid="ignore", divide="ignore"):
            at = at - value / ((3 * third * at + 2 * second) * at + first)
    return at


def _polynomials(at: Floats, values: Floats, degree: int) -> Floats:
    """Fit polynomials (n, degree + 1), highest power first, to values (n, k) at (k,)."""
    fit = np.linalg.pinv(np.vander(at, degree + 1))
    return np.asarray(values @ fit.T)
