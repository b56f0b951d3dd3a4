"""Lamps, far or near, and ambient light, estimated from the picture of the page that they light.

Bare paper gives back light in all directions alike (Lambert), so its brightness over the surface is the light's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np
from scipy.optimize import minimize

from restore.numerics import SMALL
from restore.robust import robust_sigma
from restore.scan import Floats, Ints, Mask
from restore.shading.horizon_map import HorizonMap
from restore.shading.light import ROOM, Light, Places, room_terms, terms_of
from restore.shading.relief import Field

MAX_LAMPS = 2  # a third is as good as room light, and would be fitted to figures
SAMPLES = 1000  # of bare paper: thirteen unknowns, and lamps must be tried in hundreds of places within 0.1 s
AZIMUTHS, POLARS = 12, (25.0, 45.0, 65.0)  # degrees from the page's normal: where a lamp is first looked for
FIRST_NEARNESS = 7e-4  # per mm: between a desk lamp and a far one
SIMPLEX = (0.15, 0.12, 5e-4)  # first steps of the search: radians, radians, per mm
PROMISING = 0.995  # the first guess at a lamp must bring the deviation down to this share: no worse one ends well
WORTH = 0.85  # a lamp must bring the deviation down to this share, or it explains figures and noise
EVEN = 0.005  # of the light: less than the noise of a cell; what is that even needs no lamp to explain it
RIDGE = 1e-5  # of the mean: a flat page tells lamp and room not apart, and none of them may grow without end
CLOSEST_MM = 200.0  # no lamp stands nearer: the page would not fit under it
ABOVE = 20.0  # nothing is brighter than bare paper: what lies above a first guess of its light weighs so much more
OUTLYING = 3.0  # robust deviations: places farther off count as ink, figure or gloss
# Of the light: no narrower is the robust deviation taken, before all lamps are found and after.
DOUBTED = 0.1  # weight of a place that may be ink, in the judgement of lamps
FLOOR, LAST_FLOOR = 0.04, 0.01
ROUNDS = 5
TRIALS = 120  # of the search that refines one lamp: it ends within half a degree
# Of the search for lamps whose place is nearly known: two degrees twice, and a seventh of the first guess.
NEAR_SIMPLEX, NEAR_TRIALS = (0.03, 0.03, 1e-4), 60


def fit_light(colour: Field, places: Places, horizon: HorizonMap, labels: Ints | None = None) -> Light:
    """Light that explains the linear colour (n, 3) of places.

    labels (n,): regions of constant print, 1 the one whose brightness the light is measured in; the albedo of every
    other is an unknown of its own. Without them the places are bare paper, some of which may be ink after all.
    """
    brightness = colour.mean(axis=1).astype(float)
    if labels is None:
        labels, weights = np.ones(len(colour), np.int64), _first_guess(brightness, places)
    else:
        weights = np.ones(len(colour))
    fit = _Fit(brightness, places, horizon, places.points.mean(axis=0), weights, labels)
    lamps = np.empty((0, 3))
    enough = EVEN * fit.level
    while len(lamps) < MAX_LAMPS and fit.deviation(lamps) > enough:
        found = _add_lamp(lamps, fit)
        if not fit.better(found, lamps, PROMISING):
            break
        found = _refine_lamps(found, fit)
        if not fit.better(found, lamps, WORTH):
            break
        lamps = found
        fit = fit.reweighted(lamps, FLOOR)
    return _light_of(lamps, fit, colour)


def refit_light(light: Light, colour: Field, places: Places) -> Light:
    """A light fitted anew to the linear colour (n, 3) of places of bare paper, its lamps near to where they are.

    It is returned as it is when a lamp would have to take light away from these places: they show print.
    """
    paper = np.ones(len(colour))
    fit = _Fit(colour.mean(axis=1).astype(float), places, light.horizon, light.middle, paper, paper.astype(np.int64))
    trusted = fit.reweighted(light.lamps, FLOOR)
    if not np.isfinite(trusted.deviation(light.lamps)):
        return light
    placed = _light_of(_refine_lamps(light.lamps, trusted, NEAR_SIMPLEX, NEAR_TRIALS), fit, colour)
    return placed if (placed.strengths[ROOM:] >= 0).all() else light


def _light_of(lamps: Floats, fit: _Fit, colour: Field) -> Light:
    """The light of lamps and room that explains the linear colour (n, 3) of most places of a fit."""
    fit = fit.reweighted(lamps, LAST_FLOOR)
    channels = (replace(fit, brightness=colour[:, k].astype(float)) for k in range(3))
    strengths = np.stack([channel.strengths(lamps) for channel in channels], axis=1)
    return Light(lamps, strengths, fit.middle, fit.horizon)


def _first_guess(brightness: Floats, places: Places) -> Floats:
    """(n,) 1 for what may be bare paper: near the upper side of a light that varies slowly over page and slopes.

    Asymmetric least squares (Newey & Powell, Econometrica 55(4), 1987): ink only darkens.
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
    """(n,) 1 where what is left of the brightness lies with most of the known places, 0 elsewhere."""
    known = known if known.any() else np.ones(len(rest), bool)
    centre = float(np.median(rest[known]))
    deviation = robust_sigma(rest[known] - centre)
    return np.asarray(np.abs(rest - centre) < OUTLYING * max(deviation, floor)).astype(float)


@dataclass(frozen=True, eq=False)
class _Fit:
    """What lamps are fitted to."""

    brightness: Floats
    places: Places
    horizon: HorizonMap
    middle: Field
    weights: Floats
    labels: Ints

    @cached_property
    def level(self) -> float:
        """Mean brightness of the region that the light is measured in."""
        return float(self.brightness[self.labels == 1].mean())

    @cached_property
    def target(self) -> Floats:
        """(n,) what the reduced terms are fitted to: the brightness, or 0 where the albedo is eliminated."""
        return np.where(self.labels == 1, self.brightness, 0.0)

    @cached_property
    def room(self) -> Floats:
        """(n, 4): the room's light and its three slopes."""
        return room_terms(self.places)

    @cached_property
    def cap(self) -> float:
        """What a place that no light explains may count at most."""
        return OUTLYING * FLOOR * self.level

    def terms(self, lamps: Floats) -> Floats:
        """(n, 4 + k): the room's light, its three slopes, and each lamp's light, reduced by the unknown albedos.

        In a region of albedo a the brightness is b = a·t·s for terms t and strengths s. The best 1/a for given s is
        linear in s, so that t·s − b/a = t'·s with t' = t − b (Σ w b t) / (Σ w b²).
        """
        terms = terms_of(self.room, self.places, self.horizon, self.middle, lamps)
        for label in self.others:
            here = self.labels == label
            brightness, weighted = self.brightness[here], (self.weights * self.brightness)[here]
            terms[here] -= np.outer(brightness, weighted @ terms[here] / max(float(weighted @ brightness), SMALL))
        return np.asarray(terms)

    @cached_property
    def others(self) -> Ints:
        """(m,) labels of the regions of unknown albedo."""
        return np.unique(self.labels[self.labels != 1])

    def strengths(self, lamps: Floats) -> Floats:
        """(4 + k,) the best strengths of room and lamps."""
        return _solve(self.terms(lamps), self.target, self.weights)

    def residual(self, lamps: Floats) -> Floats:
        """(n,) what the best strengths of room and lamps leave of the brightness."""
        terms = self.terms(lamps)
        return np.asarray(self.target - terms @ _solve(terms, self.target, self.weights))

    def deviation(self, lamps: Floats, doubted: float = DOUBTED) -> float:
        """Its root mean square; infinite when a lamp would have to take light away.

        Ink counts no more than any other that no light explains; a shadow that another lamp would explain counts.
        """
        return float(_truncated_rms(self.terms(lamps), self.target, self.weights, self.cap, doubted))

    def better(self, found: Floats, lamps: Floats, share: float) -> bool:
        """Whether the lamps found bring the deviation down to a share of what others leave.

        Either they explain bare paper better, or a shadow that was taken for ink.
        """
        return any(self.deviation(found, doubt) <= share * self.deviation(lamps, doubt) for doubt in (0.0, DOUBTED))

    def reweighted(self, lamps: Floats, floor: float) -> _Fit:
        """The same, trusting what these lamps explain."""
        fit = self
        for _ in range(ROUNDS):
            fit = replace(fit, weights=_inlier_weights(fit.residual(lamps), fit.weights > 0, floor * self.level))
        return fit


def _add_lamp(lamps: Floats, fit: _Fit) -> Floats:
    """The lamps and one more, looked for all over the sky."""
    azimuths = 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    sky = [(azimuth, np.radians(polar), FIRST_NEARNESS) for azimuth in azimuths for polar in POLARS]
    return min((np.vstack([lamps, lamp]) for lamp in sky), key=fit.deviation)


def _refine_lamps(
    lamps: Floats, fit: _Fit, steps: tuple[float, float, float] = SIMPLEX, trials: int = TRIALS
) -> Floats:
    """All lamps, each of them moved to where they leave least, by first steps and so many trials for each."""

    def cost(flat: Floats) -> float:
        if not all(0 <= p <= np.pi / 2 for p in flat[1::3]) or not all(0 <= n <= 1 / CLOSEST_MM for n in flat[2::3]):
            return np.inf
        return fit.deviation(flat.reshape(-1, 3))

    start = lamps.ravel()
    simplex = np.vstack([start, start + np.diag(np.tile(steps, len(lamps)))])
    simplex[:, 1::3] = np.clip(simplex[:, 1::3], 0, np.pi / 2)
    options = {"initial_simplex": simplex, "maxfev": trials * len(lamps), "xatol": 1e-4, "fatol": 1e-7}
    return np.asarray(minimize(cost, start, method="Nelder-Mead", options=options).x.reshape(-1, 3))


def _solve(terms: Floats, brightness: Floats, weights: Floats) -> Floats:
    """The strengths of the terms, by weighted least squares with a ridge."""
    weighted = terms * weights[:, None]
    scale = max(float(weights.sum()), 1.0)
    normal = weighted.T @ terms / scale
    normal[np.diag_indices_from(normal)] += RIDGE
    return np.asarray(np.linalg.solve(normal, weighted.T @ brightness / scale))


@numba.njit(cache=True)
def _truncated_rms(terms: Floats, brightness: Floats, weights: Floats, cap: float, doubted: float) -> float:
    """What is left after `_solve`, each place capped and the doubted ones counting less: root mean square."""
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
    strengths = np.linalg.solve(normal, right)
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
