"""Standard error of a light, all over the page.

Regions of constant print leave it. The estimated light is linearised in its parameters. Its residuals within the
regions move the parameters by one Gauss–Newton step, their bias; what then remains gives their covariance. Residuals of
neighbouring cells are correlated, so the covariance is that of independent blocks of the page (K.-Y. Liang, S. Zeger,
"Longitudinal data analysis using generalized linear models", Biometrika 73(1), 1986, eq. 2.3). Where the regions do not
reach, the error grows as the light is extrapolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from restore.numerics.limits import SINGLE_TINY
from restore.numerics.robust import NEVER
from restore.scan import Floats, Ints
from restore.shading.light import ROOM, Light, Terms
from restore.shading.surroundings import Places

STEPS = np.array([1e-3, 1e-3, 1e-6])  # of azimuth, polar angle and nearness for derivatives: single precision bears it
# Standard deviations of lamps before anything is seen: they may be anywhere, and strengths be as large as the light.
PRIOR_LAMP = np.array([1.0, 1.0, 2e-3])
CERTAIN = 2.0  # standard errors


@dataclass(frozen=True)
class Certainty:
    """Variation and expected error of a light.

    Root mean squares over the page, in logarithms of the light.
    """

    variation: float
    error: float

    @property
    def certain(self) -> bool:
        """Return whether the light varies by more than its error explains.

        To remove it then leaves less variation than before.
        """
        return self.variation > CERTAIN * self.error

    @property
    def sure(self) -> bool:
        """Return whether no other light need be tried.

        It varies by much more than its error explains.
        """
        return self.variation > NEVER * self.error


def certainty_of(
    light: Light, page: Places, checked: Places, brightness: Floats, labels: Ints, blocks: Ints, cap: float
) -> Certainty:
    """Return the certainty of a light on places of a page.

    checked: places with a measured brightness (n,).
    labels: (n,), regions of constant print.
    blocks: (n,), parts of the page with independent residuals.
    cap: the most that a residual in logarithms counts.
    """
    prior = _prior(light)
    here, slopes = _linearised(light, checked)
    rest = np.log(np.maximum(brightness, SINGLE_TINY)) - np.log(here)
    rest, slopes = _within_regions(rest, slopes * prior, labels, cap)
    bias, covariance = _error_of_parameters(rest, slopes, blocks)
    there, slopes = _linearised(light, page)
    slopes = (slopes - slopes.mean(axis=0)) * prior
    square = np.einsum("ni,ij,nj->n", slopes, covariance, slopes) + (slopes @ bias) ** 2
    return Certainty(float(np.std(np.log(there))), float(np.sqrt(square.mean())))


def _prior(light: Light) -> Floats:
    """Return the prior standard deviations (p,) of strengths and lamps."""
    strengths = np.full(ROOM + len(light.lamps), float(light.level.mean()))
    return np.concatenate([strengths, *[PRIOR_LAMP] * len(light.lamps)])


def _within_regions(rest: Floats, slopes: Floats, labels: Ints, cap: float) -> tuple[Floats, Floats]:
    """Return residuals and derivatives less their means over each region.

    The albedo of a region is an unknown.
    rest: (n,).
    slopes: (n, p).
    """
    rest, slopes = rest.copy(), slopes.copy()
    for label in np.unique(labels):
        of_it = labels == label
        rest[of_it] = np.clip(rest[of_it] - np.median(rest[of_it]), -cap, cap)
        rest[of_it] -= rest[of_it].mean()
        slopes[of_it] -= slopes[of_it].mean(axis=0)
    return rest, slopes


def _error_of_parameters(rest: Floats, slopes: Floats, blocks: Ints) -> tuple[Floats, Floats]:
    """Return bias (p,) and covariance (p, p) of the parameters.

    They have a prior variance of 1.
    """
    count, unknowns = len(np.unique(blocks)), slopes.shape[1]
    shrunk = slopes.T @ slopes + np.eye(unknowns) * max(float(np.mean(rest**2)), SINGLE_TINY)
    bias: Floats = np.asarray(np.linalg.solve(shrunk, slopes.T @ rest))
    rest = rest - slopes @ bias
    variance = max(float(np.mean(rest**2)), SINGLE_TINY)
    scores = np.stack([slopes[blocks == block].T @ rest[blocks == block] for block in np.unique(blocks)])
    meat = scores.T @ scores * count / max(count - unknowns, 1) + variance**2 * np.eye(unknowns)
    covariance: Floats = np.asarray(np.linalg.solve(shrunk, np.linalg.solve(shrunk, meat).T))
    return bias, covariance


def _linearised(light: Light, places: Places) -> tuple[Floats, Floats]:
    """Return the light (n,), and the derivatives of its logarithm.

    The light is the mean of its channels; the derivatives (n, p) are by strengths and lamps.
    """
    strengths = light.strengths.mean(axis=1)
    of_places = Terms(places, light.surroundings, light.middle)
    terms = of_places.of(light.lamps, light.reflectance)
    total = terms @ strengths
    columns = [terms]
    for k in range(len(light.lamps)):
        for j, step in enumerate(STEPS):
            lamps = light.lamps.copy()
            lamps[k, j] += step
            moved = of_places.of(lamps, light.reflectance) @ strengths
            columns.append(((moved - total) / step)[:, None])
    total = np.maximum(total, SINGLE_TINY)
    return total, np.hstack(columns) / total[:, None]
