"""Random developable sheets: kind, outline, holes, noise, number of points and pose drawn from a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from drivers.simulated.scene.sheets import Cone, Crumpled, Curl, Miura, MultiFold, Sheet, Wave
from oracles.exact import DISTANCE_MM, PAGE_MM, add_noise, scatter_points
from restore.mesh.triangulate import compact
from restore.scan import Floats, Ints, Mask, SurfaceMesh

POINTS = (300, 3000)
NOISE_MM = 0.15  # standard deviation at most, along the line of sight: a third more than the scanner's worst lens
FEATURE_SPACINGS = 6.0  # mean spacings: the mesh does not resolve a shorter wave or a smaller facet


@dataclass(frozen=True, eq=False)
class RandomSheet:
    """A sheet of one seed: what it is, its mesh and its flat truth (n, 2) mm."""

    seed: int
    kind: str
    outline: str
    noise_mm: float
    mesh: SurfaceMesh
    flat: Floats


def random_sheet(seed: int) -> RandomSheet:
    """A random sheet of random points, outline, holes, noise and pose; the same for the same seed."""
    rng = np.random.default_rng(seed)
    points = int(np.exp(rng.uniform(*np.log(POINTS))))
    kind, outline = (str(rng.choice(list(table))) for table in (KINDS, OUTLINES))
    sheet = KINDS[kind](rng, FEATURE_SPACINGS * np.sqrt(np.prod(PAGE_MM) / points))
    flat, faces = scatter_points(points, PAGE_MM, rng)
    flat, faces = _cut(flat, faces, OUTLINES[outline](flat[faces].mean(axis=1), rng), rng)
    noise = float(rng.uniform(0.0, NOISE_MM))
    vertices = sheet.warp(flat, PAGE_MM)
    vertices = Rotation.random(random_state=rng).apply(vertices) + [0, 0, -DISTANCE_MM]
    vertices = add_noise(vertices, np.zeros(3), noise, rng)
    return RandomSheet(seed, kind, outline, noise, SurfaceMesh(vertices, faces), flat)


def _cut(flat: Floats, faces: Ints, kept: Mask, rng: np.random.Generator) -> tuple[Floats, Ints]:
    """The part of the page inside its outline, without up to three round holes."""
    centres = flat[faces].mean(axis=1)
    for _ in range(rng.integers(0, 4)):
        hole, radius = rng.uniform(-0.4, 0.4, 2) * PAGE_MM, rng.uniform(8, 25)
        kept &= np.linalg.norm(centres - hole, axis=1) > radius
    return compact(flat, faces[kept])


def _round(points: Floats, rng: np.random.Generator) -> Mask:
    return np.asarray(np.linalg.norm(points / (rng.uniform(0.35, 0.5, 2) * PAGE_MM), axis=1) < 1)


def _torn(points: Floats, rng: np.random.Generator) -> Mask:
    """The right side torn off along a ragged line."""
    waves = rng.normal(scale=12.0 / np.arange(1, 9), size=8)
    edge = waves @ np.sin(np.outer(np.arange(1, 9), points[:, 1] * 2 * np.pi / PAGE_MM[1]) + rng.uniform(0, 6, (8, 1)))
    return np.asarray(points[:, 0] < 0.25 * PAGE_MM[0] + edge)


def _l_shaped(points: Floats, rng: np.random.Generator) -> Mask:
    return np.asarray((points < rng.uniform(-0.2, 0.3, 2) * PAGE_MM).any(axis=1))


def _whole(points: Floats, rng: np.random.Generator) -> Mask:  # noqa: ARG001 (the signature of all outlines)
    return np.ones(len(points), bool)


OUTLINES: dict[str, Callable[[Floats, np.random.Generator], Mask]] = {
    "whole": _whole,
    "round": _round,
    "torn": _torn,
    "L-shaped": _l_shaped,
}


def _curl(rng: np.random.Generator, _: float) -> Sheet:
    """Bent round up to 330°."""
    radius = rng.uniform(60, 400) * rng.choice([-1, 1])
    return Curl(radius_mm=radius, taper=rng.uniform(-0.5, 0.5), angle_deg=rng.uniform(-180, 180))


def _multifold(rng: np.random.Generator, _: float) -> Sheet:
    count = int(rng.integers(1, 5))
    middles = (np.arange(count) + 0.5) / count - 0.5
    creases = [
        (float(x * 220 + rng.uniform(-8, 8)), float(rng.uniform(-6, 6)), float(rng.uniform(10, 70) * side))
        for x, side in zip(middles, rng.choice([-1, 1], count), strict=True)
    ]
    return MultiFold(creases=tuple(creases))


def _wave(rng: np.random.Generator, feature_mm: float) -> Sheet:
    length = rng.uniform(max(40, feature_mm), 300)
    return Wave(
        slope_deg=rng.uniform(5, 65),
        wavelength_mm=length,
        angle_deg=rng.uniform(-180, 180),
        phase_deg=rng.uniform(-180, 180),
    )


def _cone(rng: np.random.Generator, _: float) -> Sheet:
    return Cone(apex_mm=rng.uniform(220, 900), opening_deg=rng.uniform(28, 80), angle_deg=rng.uniform(-180, 180))


def _miura(rng: np.random.Generator, feature_mm: float) -> Sheet:
    side, width = rng.uniform(max(35, feature_mm), 100, 2)
    return Miura(side_mm=side, width_mm=width, acute_deg=rng.uniform(55, 85), fold_deg=rng.uniform(5, 45))


def _crumpled(rng: np.random.Generator, _: float) -> Sheet:
    return Crumpled(
        planes=int(rng.integers(2, 16)),
        tilt_deg=rng.uniform(4, 14),
        steep_deg=rng.uniform(20, 50),
        seed=int(rng.integers(2**31)),
    )


KINDS: dict[str, Callable[[np.random.Generator, float], Sheet]] = {
    "curl": _curl,
    "multi-fold": _multifold,
    "wave": _wave,
    "cone": _cone,
    "Miura": _miura,
    "crumpled": _crumpled,
}
