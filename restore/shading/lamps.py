"""Estimates lamps, far or near, and ambient light.

They are estimated from the picture of the page that they light. Bare paper reflects light in all directions alike
(Lambert), so its brightness over the surface is the light's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np

from restore.numerics.limits import SMALL, TINY
from restore.numerics.robust import SIGNIFICANT, robust_sigma
from restore.scan import Floats, Ints, Mask
from restore.shading.light import ROOM, Light, Terms
from restore.shading.relief import Field
from restore.shading.surroundings import Places, Surroundings

MAX_LAMPS = 2  # a third is as good as room light, and would be fitted to figures
SAMPLES = 1000  # of bare paper: thirteen unknowns, and lamps must be tried in hundreds of places within 0.1 s
# Where a lamp is first looked for, and how far from the page's normal.
AZIMUTHS, POLARS = 12, np.radians([25.0, 45.0, 65.0])
FIRST_NEARNESS = 7e-4  # per mm: between a desk lamp and a far one
SIMPLEX = (0.15, 0.12, 5e-4)  # first steps of the search: radians, radians, per mm
PROMISING = 0.995  # the first guess at a lamp must bring the deviation down to this fraction: no worse one ends well
WORTH = 0.85  # a lamp must bring the deviation down to this fraction, or it explains figures and noise
EVEN = 0.005  # of the light: less than the noise of a cell; what is that even needs no lamp to explain it
RIDGE = 1e-5  # of the mean: a flat page does not separate lamp and room, and none of them may grow without end
ONE_SIDED = 0.5  # of the room's light, over its slope: the quarter and the half of a light from one side
CLOSEST_MM = 200.0  # no lamp stands nearer: the page would not fit under it
ABOVE = 20.0  # nothing is brighter than bare paper: what lies above a first guess of its light weighs more by this
DOUBTED = 0.1  # weight of a place that may be ink, in the judgement of lamps
# Of the light: no narrower is the robust deviation taken, before all lamps are found and after.
FLOOR, LAST_FLOOR = 0.04, 0.01
ROUNDS = 5
TRIALS = 120  # of the search that refines one lamp: it ends within half a degree
SETTLED = 1e-4  # radians, relative: the tolerance of the search
AT_BOUND = 10 * SETTLED  # no nearer than that does it end at a bound
FIRST_TRIALS = 30  # from each height at first: enough to distinguish them
# Of the search for lamps whose place is nearly known: two degrees twice, and a seventh of the first guess.
NEAR_SIMPLEX, NEAR_TRIALS = (0.03, 0.03, 1e-4), 100
REFLECTANCES = (0.0, 0.7)  # of a dark page, and of paper with print on it, before the page is known
REFLECTED = 0.2  # first step of the search for it


@dataclass(frozen=True, eq=False)
class _Guess:
    """Lamps (k, 3) as `Light` has them, and the reflectance of the page."""

    lamps: Floats
    reflectance: float


def fit_light(colour: Field, places: Places, surroundings: Surroundings, labels: Ints | None = None) -> Light:
    """Light that explains the linear colour (n, 3) of places.

    labels (n,): regions of constant print, 1 the one whose brightness the light is measured in; the albedo of every
    other is an unknown of its own. Without them the places are bare paper, some of which may be ink after all.
    """
    brightness = colour.mean(axis=1).astype(float)
    if labels is None:
        labels, weights = np.ones(len(colour), np.int64), _first_guess(brightness, places)
    else:
        weights = np.ones(len(colour))
    fit = _Fit(brightness, Terms(places, surroundings, places.points.mean(axis=0)), weights, labels)
    guess = min((_Guess(np.empty((0, 3)), fraction) for fraction in REFLECTANCES), key=fit.deviation)
    enough = EVEN * fit.level
    while len(guess.lamps) < MAX_LAMPS and fit.deviation(guess) > enough:
        starts = _starts(guess, fit)
        if not any(fit.better(start, guess, PROMISING) for start in starts):
            break
        nearer = (_refined(start, fit, trials=FIRST_TRIALS) for start in starts)
        found = _refined(min(nearer, key=fit.deviation), fit)
        if not fit.better(found, guess, WORTH):
            break
        guess = found
        fit = fit.reweighted(guess, FLOOR)
    return _light_of(guess, fit, colour)


def at_bounds(light: Light) -> bool:
    """Return whether a lamp ended at the horizon or at the least distance.

    Then it was not found.
    """
    _, polar, near = light.lamps.T
    return bool((polar > np.pi / 2 - AT_BOUND).any() or (near > (1 - AT_BOUND) / CLOSEST_MM).any())


def refit_light(light: Light, colour: Field, places: Places) -> Light:
    """Fit a light again to places of bare paper.

    Its lamps stay near to where they are. It is returned as it is when a lamp would have to remove light from these
    places: they show print.
    colour: (n, 3), linear.
    """
    brightness, terms = colour.mean(axis=1).astype(float), Terms(places, light.surroundings, light.middle)
    guess = _Guess(light.lamps, light.reflectance)
    rest = brightness - terms.of(guess.lamps, guess.reflectance) @ light.strengths.mean(axis=1)
    explained = np.abs(rest) < SIGNIFICANT * FLOOR * light.level.mean()
    fit = _Fit(brightness, terms, explained.astype(float), np.ones(len(colour), np.int64))
    trusted = fit.reweighted(guess, FLOOR)
    if not np.isfinite(trusted.deviation(guess)):
        return light
    placed = _light_of(_refined(guess, trusted, NEAR_SIMPLEX, NEAR_TRIALS, doubted=1.0), fit, colour)
    return placed if (placed.strengths[ROOM:] >= 0).all() else light


def _light_of(guess: _Guess, fit: _Fit, colour: Field) -> Light:
    """Return the light that explains most places of a fit: it consists of lamps and room.

    colour: (n, 3), linear.
    """
    fit = fit.reweighted(guess, LAST_FLOOR)
    channels = (replace(fit, brightness=colour[:, k].astype(float)) for k in range(3))
    strengths = np.stack([channel.strengths(guess) for channel in channels], axis=1)
    return Light(guess.lamps, guess.reflectance, strengths, fit.of_places.middle, fit.of_places.surroundings)


def _first_guess(brightness: Floats, places: Places) -> Floats:
    """Return 1 for places that may be bare paper, (n,).

    They are near the upper side of a light that varies slowly over page and slopes: asymmetric least squares (Newey &
    Powell, Econometrica 55(4), 1987), because ink only darkens.
    """
    reach = np.maximum(np.abs(places.points).max(axis=0), 1.0)
    x, y, _ = (places.points / reach).T.astype(float)
    terms = np.column_stack([np.ones(len(x)), x, y, x * x, x * y, y * y, places.normals[:, :2]])
    weights = np.ones(len(x))
    for _ in range(2 * ROUNDS):
        rest = brightness - terms @ _solve(terms, brightness, weights)
        weights = np.where(rest > 0, ABOVE, 1.0)
    return _inlier_weights(rest, weights > 1, FLOOR * brightness.mean())


def _inlier_weights(rest: Floats, known: Mask, floor: float) -> Floats:
    """Return 1 where residuals are like those of most known places, (n,), 0 elsewhere."""
    known = known if known.any() else np.ones(len(rest), bool)
    centre = float(np.median(rest[known]))
    deviation = robust_sigma(rest[known] - centre)
    return np.asarray(np.abs(rest - centre) < SIGNIFICANT * max(deviation, floor)).astype(float)


@dataclass(frozen=True, eq=False)
class _Fit:
    """What lamps are fitted to."""

    brightness: Floats
    of_places: Terms
    weights: Floats
    labels: Ints

    @cached_property
    def level(self) -> float:
        """Mean brightness of the region that the light is measured in."""
        return float(self.brightness[self.labels == 1].mean())

    @cached_property
    def target(self) -> Floats:
        """Return the target (n,) of the fit: brightness, or 0 where albedo is eliminated."""
        return np.where(self.labels == 1, self.brightness, 0.0)

    @cached_property
    def cap(self) -> float:
        """What a place that no light explains may count at most."""
        return SIGNIFICANT * FLOOR * self.level

    def terms(self, guess: _Guess) -> Floats:
        """Return the terms (n, 4 + k), reduced by the unknown albedos.

        The room's light, its three slopes, and each lamp's light. In a region of albedo a the brightness is b = a·t·s
        for terms t and strengths s. The best 1/a for given s is linear in s, so that t·s − b/a = t'·s with t' = t − b
        (Σ w b t) / (Σ w b²).
        """
        terms = self.of_places.of(guess.lamps, guess.reflectance)
        for label in self.others:
            here = self.labels == label
            brightness, weighted = self.brightness[here], (self.weights * self.brightness)[here]
            terms[here] -= np.outer(brightness, weighted @ terms[here] / max(float(weighted @ brightness), SMALL))
        return np.asarray(terms)

    @cached_property
    def others(self) -> Ints:
        """Return the labels (m,) of the regions of unknown albedo."""
        return np.unique(self.labels[self.labels != 1])

    def strengths(self, guess: _Guess) -> Floats:
        """Return the best strengths (4 + k,) of room and lamps."""
        normal, right = _normal_equations(self.terms(guess), self.target, self.weights)
        return np.asarray(_strengths(normal, right))

    def residual(self, guess: _Guess) -> Floats:
        """Return the residual (n,) of the brightness at the best strengths, of room and lamps."""
        terms = self.terms(guess)
        return np.asarray(self.target - terms @ _solve(terms, self.target, self.weights))

    def deviation(self, guess: _Guess, doubted: float = DOUBTED) -> float:
        """Its root mean square; infinite when a lamp would have to take light away.

        Ink counts no more than any other that no light explains; a shadow that another lamp would explain counts.
        """
        return float(_truncated_rms(self.terms(guess), self.target, self.weights, self.cap, doubted))

    def better(self, found: _Guess, guess: _Guess, fraction: float) -> bool:
        """Return whether a guess reduces another's deviation to a fraction of it.

        Either it explains bare paper better, or a shadow that was mistaken for ink.
        """
        return any(self.deviation(found, doubt) <= fraction * self.deviation(guess, doubt) for doubt in (0.0, DOUBTED))

    def reweighted(self, guess: _Guess, floor: float) -> _Fit:
        """The same, trusting what a guess explains."""
        fit = self
        for _ in range(ROUNDS):
            fit = replace(fit, weights=_inlier_weights(fit.residual(guess), fit.weights > 0, floor * self.level))
        return fit


def _starts(guess: _Guess, fit: _Fit) -> list[_Guess]:
    """Return starts with one more lamp: the best at each height over the whole sky."""
    azimuths = 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    rings = ([np.vstack([guess.lamps, (azimuth, polar, FIRST_NEARNESS)]) for azimuth in azimuths] for polar in POLARS)
    return [min((replace(guess, lamps=lamps) for lamps in ring), key=fit.deviation) for ring in rings]


def _refined(
    guess: _Guess,
    fit: _Fit,
    steps: tuple[float, float, float] = SIMPLEX,
    trials: int = TRIALS,
    doubted: float = DOUBTED,
) -> _Guess:
    """Refine all lamps, and the reflectance, to the least residual.

    steps: first steps.
    trials: for each of them.
    """

    def unpacked(flat: Floats) -> _Guess:
        return _Guess(flat[:-1].reshape(-1, 3), float(flat[-1]))

    def cost(flat: Floats) -> float:
        tried = unpacked(flat)
        (_, polar, near), reflectance = tried.lamps.T, tried.reflectance
        possible = 0 <= polar.min() <= polar.max() <= np.pi / 2 and 0 <= near.min() <= near.max() <= 1 / CLOSEST_MM
        return fit.deviation(tried, doubted) if possible and 0 <= reflectance <= 1 else np.inf

    count = len(guess.lamps)
    start = np.append(guess.lamps.ravel(), guess.reflectance)
    inwards = REFLECTED if guess.reflectance < REFLECTED else -REFLECTED
    simplex = np.vstack([start, start + np.diag([*steps * count, inwards])])
    simplex[:, 1:-1:3] = np.clip(simplex[:, 1:-1:3], 0, np.pi / 2)
    options = {"initial_simplex": simplex, "maxfev": trials * count, "xatol": SETTLED, "fatol": 1e-7}
    from scipy.optimize import minimize  # only where light is removed

    return unpacked(minimize(cost, start, method="Nelder-Mead", options=options).x)


def _solve(terms: Floats, brightness: Floats, weights: Floats) -> Floats:
    """The strengths of the terms, by weighted least squares with a ridge."""
    weighted = terms * weights[:, None]
    scale = max(float(weights.sum()), 1.0)
    normal = weighted.T @ terms / scale
    normal[np.diag_indices_from(normal)] += RIDGE
    return np.asarray(np.linalg.solve(normal, weighted.T @ brightness / scale))


@numba.njit(cache=True)
def _normal_equations(terms: Floats, brightness: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Set up weighted least squares with a ridge: (k, k) and (k,) for terms (n, k)."""
    count, size = terms.shape
    normal, right = np.zeros((size, size)), np.zeros(size)
    total = max(weights.sum(), 1.0)
    for n in range(count):
        for i in range(size):
            weighted = weights[n] * terms[n, i] / total
            right[i] += weighted * brightness[n]
            for j in range(size):
                normal[i, j] += weighted * terms[n, j]
    for i in range(size):
        normal[i, i] += RIDGE
    return normal, right


@numba.njit(cache=True)
def _strengths(normal: Floats, right: Floats) -> Floats:
    """Solve for the strengths (4 + k,) of room and lamps.

    The room must take no light away from any side.
    Light from one side alone is clamp(cos θ), whose mean is half of its slope (Basri & Jacobs 2003, eq. 8); no other
    room has a smaller mean. Where the best strengths break this, all of the room's light comes from their side.
    """
    strengths = np.linalg.solve(normal, right)
    slope = np.sqrt((strengths[1:ROOM] ** 2).sum())
    if strengths[0] >= ONE_SIDED * slope:
        return np.asarray(strengths)
    one_side = np.zeros((len(right), len(right) - ROOM + 1))
    one_side[0, 0] = ONE_SIDED
    one_side[1:ROOM, 0] = strengths[1:ROOM] / max(slope, TINY)
    for k in range(len(right) - ROOM):
        one_side[ROOM + k, 1 + k] = 1.0
    few = np.linalg.solve(one_side.T @ normal @ one_side, one_side.T @ right)
    if few[0] < 0:
        few[:] = 0.0
        if len(right) > ROOM:
            few[1:] = np.linalg.solve(normal[ROOM:, ROOM:].copy(), right[ROOM:].copy())
    return np.asarray(one_side @ few)


@numba.njit(cache=True)
def _truncated_rms(terms: Floats, brightness: Floats, weights: Floats, cap: float, doubted: float) -> float:
    """Return the rms residual of the best strengths, each place capped.

    The doubted ones count less.
    """
    count, size = terms.shape
    strengths = _strengths(*_normal_equations(terms, brightness, weights))
    if size > ROOM and strengths[ROOM:].min() < 0:
        return np.inf
    square = 0.0
    for n in range(count):
        rest = brightness[n]
        for i in range(size):
            rest -= terms[n, i] * strengths[i]
        rest = min(abs(rest), cap)
        square += (1.0 if weights[n] > 0 else doubted) * rest * rest
    return np.sqrt(square / count)
