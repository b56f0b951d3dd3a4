"""The light on a page, chosen among hypotheses.

They differ in how well they explain regions of constant print. Either the brightest of the page is paper, or its
largest regions are of constant print, light or dark, each with its own albedo. Lamps are fitted under both. They are
compared with even light, at places that no fit has seen: a light that does not reliably explain the gradients there is
not used.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from restore.numerics.robust import SIGNIFICANT
from restore.scan import Floats, Ints, Mask
from restore.shading.certainty import CERTAIN, Certainty, certainty_of
from restore.shading.channels import as_list
from restore.shading.lamps import SAMPLES, at_bounds, fit_light
from restore.shading.light import Light
from restore.shading.regions import EDGE, Regions, regions_of, unexplained
from restore.shading.relief import Field
from restore.shading.shadow_edges import place_lamps
from restore.shading.surroundings import Places, Surroundings

MIN_PAPER = 50  # cells: fewer say nothing of the light
MIN_REGIONS = 0.02  # of the page: smaller regions of constant print cannot reject a light
CAP = 0.15  # of the light: what deviates by more is print
BLOCKS = 6  # across and down: within one, deviations go together
DIMMEST = 32.0  # of the level light: less is not found in any hollow, and would be divided by
CHECK_PLACES = 4000  # places: six to a square centimetre of A4
CHECK_STRIDE, PAGE = 2, 2000  # every second check place, and cells of the page, suffice for the certainty


def blocks_of(cells: Ints, shape: tuple[int, ...]) -> Ints:
    """Return the numbers of the blocks of a page that cells lie in.

    cells: (n,). shape: (r, c) of the page.
    """
    row, col = np.divmod(cells, shape[1])
    return row * BLOCKS // shape[0] * BLOCKS + col * BLOCKS // shape[1]


def block_sums(values: Floats, blocks: Ints) -> tuple[float, float]:
    """Add up values (n,), and estimate the standard error of the sum.

    Deviations within a block go together, so that the blocks are what is counted.
    """
    sums = np.bincount(blocks, values, BLOCKS**2)[np.bincount(blocks, minlength=BLOCKS**2) > 0]
    return float(sums.sum()), float(sums.std() * np.sqrt(len(sums))) if len(sums) else 0.0


@dataclass(frozen=True, eq=False)
class CheckPlaces:
    """Places of regions of constant print, none of them used by a fit.

    cells (n,) numbers of cells; colour (n, 3) linear; labels (n,) regions; blocks (n,) parts of the page.
    """

    cells: Ints
    colour: Field
    labels: Ints
    blocks: Ints

    @classmethod
    def of(cls, colour: Field, regions: Regions, inside: Mask) -> CheckPlaces:
        """Spread check places over the regions of a page.

        colour: (r, c, 3), linear. None are placed where regions are too small.
        """
        known = np.flatnonzero(regions.labels)
        if len(known) < max(MIN_REGIONS * inside.sum(), MIN_PAPER):
            known = known[:0]
        cells = known[1 :: max(2, len(known) // CHECK_PLACES)]
        return cls(cells, as_list(colour)[cells], regions.labels.ravel()[cells], blocks_of(cells, inside.shape))

    def __getitem__(self, chosen: Mask | slice) -> CheckPlaces:
        return CheckPlaces(self.cells[chosen], self.colour[chosen], self.labels[chosen], self.blocks[chosen])

    def unexplained(self, light: Field) -> Floats:
        """Return the squared deviations (n,) that a light leaves.

        Mean over the channels.
        light: (cells, 3).
        """
        seen, given = light[self.cells].astype(float), self.colour.astype(float)
        channels = [unexplained(given[:, k], seen[:, k], self.labels, CAP) for k in range(3)]
        return np.asarray(np.mean(channels, axis=0))

    def gain(self, light: Field, other: Field) -> tuple[float, float]:
        """Return by how much less a light leaves than another.

        light, other: (cells, 3).
        Returns also the standard error of that sum.
        """
        return block_sums(self.unexplained(other) - self.unexplained(light), self.blocks)

    def prefer(self, light: Field, other: Field, errors: float = CERTAIN) -> bool:
        """Return whether a light leaves less than another, by the given number of standard errors.

        light, other: (cells, 3).
        """
        gain, error = self.gain(light, other)
        return gain > errors * error

    def certainty(self, light: Light, places: Places, inside: Mask) -> Certainty:
        """How certain a light is over the page. inside: (cells,) the page's own."""
        known = np.flatnonzero(inside)
        page, some = known[:: max(1, len(known) // PAGE)], self[::CHECK_STRIDE]
        brightness = some.colour.mean(axis=1)
        return certainty_of(light, places[page], places[some.cells], brightness, some.labels, some.blocks, CAP)


@dataclass(frozen=True, eq=False)
class Estimate:
    """A light and its values on all cells (cells, 3); fitted_to is "paper" or "regions"."""

    light: Light
    values: Field
    fitted_to: str
    certainty: Certainty


def estimate_light(
    colour: Field,
    paper: Ints,
    places: Places,
    surroundings: Surroundings,
    regions: Regions,
    checks: CheckPlaces,
    inside: Mask,
) -> Estimate | None:
    """Estimate the light on a page.

    Lamps of several colours must explain the regions better than one colour.
    colour: (cells, 3), linear.
    paper: (k,), cells that may be bare paper.
    Returns None unless the light is reliable and the check places prefer it to even light.
    """
    best: Estimate | None = None
    values = np.ones_like(colour)
    for fitted_to, fitted in _candidates(colour, paper, places, surroundings, regions.labels, inside):
        certainty = checks.certainty(fitted, places, inside)
        if at_bounds(fitted) or not certainty.certain:
            continue
        for light in (fitted.of_one_colour, fitted):
            found = light.irradiance(places)
            asked = SIGNIFICANT if light is fitted else CERTAIN
            if (found[checks.cells] > 0).all() and checks.prefer(found, values, asked):
                best, values = Estimate(light, found, fitted_to, certainty), found
        if certainty.sure:
            break
    return best


def estimate_again(
    first: Estimate,
    colour: Field,
    normals: Field,
    paper: Ints,
    places: Places,
    surroundings: Surroundings,
    inside: Mask,
) -> tuple[Estimate, CheckPlaces] | None:
    """Estimate the light again, with regions that end along creases too.

    The regions end at edges of print there. The first estimate gives the steps of the light, which before could not be
    distinguished from those of print.
    colour: (r, c, 3), linear.
    """
    # Off the page the light is NaN.
    light = np.fmax(first.values.reshape(colour.shape), first.light.level.mean() / DIMMEST)
    even = np.divide(colour, light, dtype=np.float32)
    regions = regions_of(even, normals, inside, EDGE)
    checks = CheckPlaces.of(colour, regions, inside)
    if not len(checks.cells):
        return None
    found = estimate_light(as_list(colour), paper, places, surroundings, regions, checks, inside)
    return None if found is None else (found, checks)


def _candidates(
    colour: Field, paper: Ints, places: Places, surroundings: Surroundings, labels: Ints, inside: Mask
) -> Iterator[tuple[str, Light]]:
    """What the light may be fitted to, and the light."""
    if len(paper) >= MIN_PAPER:
        chosen = paper[:: max(1, len(paper) // SAMPLES)]
        fitted = fit_light(colour[chosen], places[chosen], surroundings)
        yield "paper", place_lamps(fitted, colour.reshape(*inside.shape, 3), chosen, places, inside)
    labels = labels.ravel()
    known = np.flatnonzero(labels)
    chosen = known[:: max(2, len(known) // SAMPLES)]
    if (labels[chosen] == 1).sum() >= MIN_PAPER:
        yield "regions", fit_light(colour[chosen], places[chosen], surroundings, labels[chosen])
