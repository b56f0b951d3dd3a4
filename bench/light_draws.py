"""Sheets and lamps drawn at random, one kind of them a function: what the benches of light and of words are run on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from drivers.simulated import Binding, Cone, Crumpled, Curl, Miura, MultiFold, Spread, Wave
from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.illumination import irradiance
from drivers.simulated.scene.light import Lamp, Light
from drivers.simulated.scene.scene import Scene
from drivers.simulated.scene.sheets import Sheet

BRIGHTEST = 99  # percentile of the light on the page that the exposure takes for white
SPOT = "spot"  # lamp whose cone is no part of a scene's light


@dataclass(frozen=True)
class Spot:
    """The cone (mm at the page) that a lamp lights, and what is left of it outside."""

    middle_mm: tuple[float, float]
    radius_mm: float
    outside: float


def _multi_fold(rng: np.random.Generator) -> Sheet:
    folds, lean = rng.uniform(25, 40, 3) * rng.choice([-1, 1]), rng.uniform(-8, 8)
    places = zip((-72.0, -3.0, 68.0), folds, (1, -1, 1), strict=True)
    return MultiFold(creases=tuple((x + rng.uniform(-8, 8), lean * sign, fold * sign) for x, fold, sign in places))


SHEETS: dict[str, Callable[[np.random.Generator], Sheet]] = {
    "curl": lambda rng: Curl(radius_mm=rng.uniform(125, 220), angle_deg=rng.uniform(-25, 25)),
    "wave": lambda rng: Wave(
        slope_deg=rng.uniform(18, 30), wavelength_mm=rng.uniform(95, 180), angle_deg=rng.uniform(-80, 80)
    ),
    "gutter": lambda rng: Spread(slope_deg=rng.uniform(48, 68), reach_mm=rng.uniform(16, 35)),
    "multi-fold": _multi_fold,
    "crumpled": lambda rng: Crumpled(seed=int(rng.integers(1000)), tilt_deg=rng.uniform(7, 11)),
    "binding": lambda rng: Binding(slope_deg=rng.uniform(45, 60), reach_mm=rng.uniform(25, 45)),
    "Miura": lambda rng: Miura(fold_deg=rng.uniform(22, 30), acute_deg=rng.uniform(68, 76)),
    "cone": lambda rng: Cone(
        apex_mm=rng.uniform(230, 340), opening_deg=rng.uniform(32, 40), angle_deg=rng.uniform(-40, 40)
    ),
}


def _lamp(rng: np.random.Generator, far: float, height: float, **how: object) -> Lamp:
    """A lamp on some side, `far` mm from the axis and `height` mm above the page's middle."""
    turn = rng.uniform(0, 2 * np.pi)
    return Lamp((far * np.cos(turn), far * np.sin(turn), height - 900.0), **how)


def _near(rng: np.random.Generator) -> tuple[Light, Spot | None]:
    lamp = _lamp(rng, rng.uniform(250, 500), rng.uniform(350, 700), share=rng.uniform(0.4, 0.75))
    return Light((lamp,), 1 - lamp.share, shadows=True), None


def _window(rng: np.random.Generator) -> tuple[Light, Spot | None]:
    lean = rng.uniform(0.15, 0.4) * np.array([np.cos(a := rng.uniform(0, 6.28)), np.sin(a)])
    share = rng.uniform(0.2, 0.45)
    lamp = _lamp(rng, rng.uniform(900, 1600), rng.uniform(300, 900), share=share, radius_mm=rng.uniform(100, 400))
    return Light((lamp,), 1 - share, lean=(float(lean[0]), float(lean[1])), shadows=True), None


def _two_colours(rng: np.random.Generator) -> tuple[Light, Spot | None]:
    warm, cool = rng.uniform(0.05, 0.2, 2)
    one = _lamp(rng, rng.uniform(400, 800), rng.uniform(400, 900), share=0.35, colour=(1 + warm, 1.0, 1 - warm))
    two = _lamp(rng, rng.uniform(400, 800), rng.uniform(400, 900), share=0.3, colour=(1 - cool, 1.0, 1 + cool))
    return Light((one, two), 0.35, shadows=True), None


def _raking(rng: np.random.Generator) -> tuple[Light, Spot | None]:
    share = rng.uniform(0.3, 0.6)
    lamp = _lamp(rng, rng.uniform(600, 1200), rng.uniform(200, 400), share=share, radius_mm=rng.uniform(0, 40))
    return Light((lamp,), 1 - share, shadows=True), None


def _spot(rng: np.random.Generator) -> tuple[Light, Spot | None]:
    lamp = _lamp(rng, rng.uniform(100, 400), rng.uniform(500, 800), share=rng.uniform(0.4, 0.6))
    x, y = rng.uniform(-80, 80), rng.uniform(-50, 50)
    return Light((lamp,), 1 - lamp.share, shadows=True), Spot((x, y), rng.uniform(90, 160), rng.uniform(0.2, 0.5))


def _even(rng: np.random.Generator) -> tuple[Light, Spot | None]:
    return Light((_lamp(rng, 100.0, 1500.0, share=0.1),), 0.9, shadows=True), None


LAMPS: dict[str, Callable[[np.random.Generator], tuple[Light, Spot | None]]] = {
    "near": _near,
    "window": _window,
    "two colours": _two_colours,
    "raking": _raking,
    "spot": _spot,
    "nearly even": _even,
}


def sparing_highlights(light: Light, scene: Scene) -> Light:
    """The light on a scene as a camera records it whose exposure spares the highlights of the page."""
    face = np.flatnonzero(scene.on_page)
    middles = scene.vertices[scene.faces[face]].mean(axis=1)
    field = np.sum(irradiance(light, FaceMaps.of(scene), face, middles, -float(scene.surface.shift[2])), axis=0)
    scale = 1 / max(1.0, float(np.percentile(field, BRIGHTEST)))
    lamps = tuple(replace(lamp, share=scale * lamp.share) for lamp in light.lamps)
    return replace(light, lamps=lamps, ambient=scale * light.ambient)
