"""`python -m bench.random_sheets [--count 500]`: random developable sheets, whether every one comes out whole."""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from bench.exact import DISTANCE_MM, PAGE_MM, scattered, with_noise
from bench.markers import rigid_residual
from bench.overlaps import overlapping_pairs
from drivers.simulated.sheets import Cone, Crumpled, Curl, Miura, MultiFold, Sheet, Wave
from restore import RestoreError, flatten
from restore.mesh.measures import edge_strain, flipped_faces
from restore.mesh.network import edges_of
from restore.mesh.triangulate import compact
from restore.scan import Floats, Ints, Mask, SurfaceMesh

COUNT = 500
POINTS = (300, 3000)
NOISE_MM = 0.15  # standard deviation at most, along the line of sight: a third more than the scanner's worst lens
MOST_STRAIN = 0.02  # rms over the edges of a sheet, against what they measure on the surface
SEEN = 6.0  # mean spacings: a wave or a facet that is shorter is not there for who has only the points
ROW = "{:<10}{:>7}{:>8}{:>9}{:>10}{:>13}{:>13}{:>10}{:>10}"


@dataclass(frozen=True, eq=False)
class RandomSheet:
    """A sheet of one seed: what it is, its mesh and its flat truth (n, 2) mm."""

    seed: int
    kind: str
    outline: str
    noise_mm: float
    mesh: SurfaceMesh
    flat: Floats


@dataclass(frozen=True)
class Outcome:
    """How a sheet came out. failed is the message of what was raised, or empty."""

    sheet: RandomSheet
    failed: str = ""
    flips: int = 0
    overlaps: int = 0
    strain: float = 0.0
    rms_mm: float = 0.0

    @property
    def sound(self) -> bool:
        """Whether it is a page: whole, unfolded, unstretched."""
        return not (self.failed or self.flips or self.overlaps or self.strain > MOST_STRAIN)


def main(count: int = COUNT) -> None:
    """Print what came of the sheets of all seeds below `count`, kind by kind."""
    start = time.perf_counter()
    print(f"\n{count} random developable sheets, {POINTS[0]} to {POINTS[1]} points, noise up to {NOISE_MM} mm")
    outcomes = [judged(random_sheet(seed)) for seed in range(count)]
    print(
        ROW.format(
            "sheet", "count", "failed", "flipped", "overlaps", "worst strain", "above bound", "median", "worst mm"
        )
    )
    kinds = sorted({o.sheet.kind for o in outcomes})
    for kind in [*kinds, "all"]:
        print(_line(kind, [o for o in outcomes if kind in (o.sheet.kind, "all")]))
    for o in outcomes:
        if not o.sound:
            s = o.sheet
            print(f"seed {s.seed} {s.kind} {s.outline} {len(s.flat)} points, noise {s.noise_mm:.2f}: {o.failed}")
            print(f"  flips {o.flips}, overlaps {o.overlaps}, strain {o.strain:.4f}, rms {o.rms_mm:.3f} mm")
    print(f"bound of the strain {MOST_STRAIN}; {time.perf_counter() - start:.0f} s")


def _line(kind: str, outcomes: list[Outcome]) -> str:
    faults = Counter[str]()
    for o in outcomes:
        faults.update(failed=bool(o.failed), flips=o.flips, overlaps=o.overlaps, strained=o.strain > MOST_STRAIN)
    rms = [o.rms_mm for o in outcomes]
    return ROW.format(
        kind,
        len(outcomes),
        *(faults[name] for name in ("failed", "flips", "overlaps")),
        f"{max(o.strain for o in outcomes):.4f}",
        faults["strained"],
        f"{np.median(rms):.3f}",
        f"{max(rms):.3f}",
    )


def judged(sheet: RandomSheet) -> Outcome:
    """Flatten a sheet as anybody would, and see what came of it."""
    try:
        page = flatten(sheet.mesh)
    except RestoreError as error:
        return Outcome(sheet, failed=str(error))
    strain = edge_strain(page.flat, edges_of(page.faces), page.lengths)
    rest, _ = rigid_residual(page.flat, sheet.flat)
    return Outcome(
        sheet,
        flips=flipped_faces(page.flat, page.faces),
        overlaps=len(overlapping_pairs(page.flat, page.faces)),
        strain=float(np.sqrt((strain**2).mean())),
        rms_mm=float(np.sqrt((rest**2).sum(axis=1).mean())),
    )


def random_sheet(seed: int) -> RandomSheet:
    """A random sheet of random points, outline, holes, noise and pose; the same for the same seed."""
    rng = np.random.default_rng(seed)
    points = int(np.exp(rng.uniform(*np.log(POINTS))))
    kind, outline = (str(rng.choice(list(table))) for table in (KINDS, OUTLINES))
    sheet = KINDS[kind](rng, SEEN * np.sqrt(np.prod(PAGE_MM) / points))
    flat, faces = scattered(points, PAGE_MM, rng)
    flat, faces = _cut(flat, faces, OUTLINES[outline](flat[faces].mean(axis=1), rng), rng)
    noise = float(rng.uniform(0.0, NOISE_MM))
    vertices = sheet.warp(flat, PAGE_MM)
    vertices = Rotation.random(random_state=rng).apply(vertices) + [0, 0, -DISTANCE_MM]
    vertices = with_noise(vertices, np.zeros(3), noise, rng)
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


def _whole(points: Floats, rng: np.random.Generator) -> Mask:  # noqa: ARG001 (nothing is cut off at random)
    return np.ones(len(points), bool)


OUTLINES: dict[str, Callable[[Floats, np.random.Generator], Mask]] = {
    "whole": _whole,
    "round": _round,
    "torn": _torn,
    "L-shaped": _l_shaped,
}


def _curl(rng: np.random.Generator, _: float) -> Sheet:
    """Up to 330° round."""
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


def _wave(rng: np.random.Generator, seen: float) -> Sheet:
    length = rng.uniform(max(40, seen), 300)
    return Wave(
        slope_deg=rng.uniform(5, 65),
        wavelength_mm=length,
        angle_deg=rng.uniform(-180, 180),
        phase_deg=rng.uniform(-180, 180),
    )


def _cone(rng: np.random.Generator, _: float) -> Sheet:
    return Cone(apex_mm=rng.uniform(220, 900), opening_deg=rng.uniform(28, 80), angle_deg=rng.uniform(-180, 180))


def _miura(rng: np.random.Generator, seen: float) -> Sheet:
    side, width = rng.uniform(max(35, seen), 100, 2)
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

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT)
    main(parser.parse_args().count)
