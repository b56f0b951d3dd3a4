"""Quality figures of a picture of a chart, with the guidelines' levels that each meets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from station.colour.chart import GREYS
from station.colour.fit import ColourFit
from station.colour.lab import difference

UNMEASURED = ("sharpness (MTF, SFR)", "evenness of the light over the field", "geometry", "colour misregistration")
"""The guidelines ask for these, too, and a chart of patches does not show them.

Therefore no level as a whole is claimed.
"""

Limits = Mapping[str, float]
STARS, LEVELS = ("4 stars", "3 stars", "2 stars", "1 star"), ("level A", "level B", "level C")


def _limits(names: tuple[str, ...], *limits: float) -> Limits:
    return dict(zip(names, limits, strict=True))


@dataclass(frozen=True)
class Criterion:
    """Figure and its limits, strictest first: at most that, or at least where `least`.

    Limits of FADGI 2023 (bound volumes: general collections) and ISO 19264-1:2021 as compared in "Tabela porównawcza:
    FADGI/ISO/Metamorfoze", skandalski.pl; the tables of both themselves were not available. 36 CFR 1236.50 (b) and (d),
    which goes by FADGI's three stars, asks for 300 ppi as well.
    """

    name: str
    unit: str
    fadgi: Limits
    iso: Limits
    least: bool = False

    def met(self, value: float, limits: Limits) -> str | None:
        """The strictest level that the value meets, None when it meets none."""
        sign = -1 if self.least else 1
        return next((level for level, limit in limits.items() if sign * value <= sign * limit), None)


CRITERIA = (
    Criterion("colour, mean", "ΔE2000", _limits(STARS, 2, 3.5, 5, 6.5), _limits(LEVELS, 4, 5, 5)),
    Criterion("colour, 90th percentile", "ΔE2000", _limits(STARS, 4, 7, 10, 13), {}),
    Criterion("colour, worst", "ΔE2000", {}, _limits(LEVELS, 10, 15, 15)),
    Criterion("tone, worst grey", "ΔL*", _limits(STARS, 1.5, 3, 4.5, 6), _limits(LEVELS, 2, 3, 4)),
    Criterion("white balance, worst grey", "ΔE(a*b*)", _limits(STARS, 2, 4, 6, 8), _limits(LEVELS, 3, 4, 5)),
    Criterion("noise, worst grey", "L* rms", _limits(STARS, 1, 2, 3, 4), _limits(LEVELS, 1.6, 2, 2.2)),
    Criterion("sampling", "ppi", _limits(STARS, 396, 294, 242.5, 190), {}, least=True),
)


def quality_figures(fit: ColourFit, *, ppi: float | None = None) -> list[dict[str, Any]]:
    """Return every measured figure with the levels it meets, None where a level is not met.

    Colour, tone and white balance are those of patches that had no part in the fit. In uneven light no figure meets any
    level: what a camera does in even light was not seen.
    ppi: pixels per inch of the target, where known.
    """
    colour, greys = difference(fit.left_out, fit.reference), (fit.left_out - fit.reference)[GREYS]
    values: dict[str, float | None] = {
        "colour, mean": float(colour.mean()),
        "colour, 90th percentile": float(np.percentile(colour, 90)),
        "colour, worst": float(colour.max()),
        "tone, worst grey": float(np.abs(greys[:, 0]).max()),
        "white balance, worst grey": float(np.hypot(greys[:, 1], greys[:, 2]).max()),
        "noise, worst grey": float(fit.noise[GREYS].max()),
        "sampling": ppi,
    }
    even = not fit.fall_off
    return [
        _figure(criterion, value, even=even) for criterion in CRITERIA if (value := values[criterion.name]) is not None
    ]


def _figure(criterion: Criterion, value: float, *, even: bool) -> dict[str, Any]:
    figure: dict[str, Any] = {"figure": criterion.name, "value": round(value, 3), "unit": criterion.unit}
    for guideline, limits in (("FADGI", criterion.fadgi), ("ISO 19264-1", criterion.iso)):
        if limits:
            figure[guideline] = criterion.met(value, limits) if even else None
    return figure


def mean_differences(fit: ColourFit) -> dict[str, float]:
    """Return mean CIEDE2000 over the chart: as sRGB, by the profile, on held-out patches."""
    codings = {"as sRGB": fit.uncorrected, "by the profile": fit.corrected, "on held-out patches": fit.left_out}
    return {how: round(float(difference(lab, fit.reference).mean()), 3) for how, lab in codings.items()}
