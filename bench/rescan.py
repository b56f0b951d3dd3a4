"""`python -m bench.rescan [--count 30] [--seed 0]`: corrections of openings that are captured again.

Two of three openings are captured again with another curvature, turned and moved; of the others the leaf was turned in
between. Printed, for each: the error of carried points on the paper, or that they were dropped.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from drivers.simulated import Facing, Opening, Pose, Truth, shoot
from restore import RangeScan
from restore.scan import Floats
from station.session.corrections.transfer import motion_between

PAGE_MM, SPINE_MM = (200.0, 130.0), 100.0
PLACES_MM = np.array([[20.0, 20.0], [80.0, 110.0], [100.0, 65.0], [130.0, 30.0], [180.0, 100.0]])
MAX_ERROR_MM = 0.7  # of carried points: a sample of the fast mode


def opening(random: np.random.Generator, artwork: int) -> tuple[RangeScan, Truth]:
    """Return a capture of an opening with a curvature and a pose of its own."""
    left, right = random.uniform(25, 55, 2)
    pose = Pose(turn_deg=random.uniform(-3, 3), shift_mm=(random.uniform(-8, 8), random.uniform(-8, 8), 0.0))
    return shoot(
        Opening(left_deg=left, right_deg=right),
        Facing(left_mm=SPINE_MM, seed=artwork),
        page_mm=PAGE_MM,
        mode="fast",
        pose=pose,
        seed=int(random.integers(1_000_000)),
    )


def pixels_of(scan: RangeScan, truth: Truth, places: Floats) -> Floats:
    """Return where printed places (n, 2) mm are seen, (n, 2) px of the colour image, between samples."""
    found = []
    for place in places:
        apart = np.hypot(*(truth.flat - place).transpose(2, 0, 1))
        near = np.unravel_index(np.argsort(np.where(np.isfinite(apart), apart, np.inf), axis=None)[:9], apart.shape)
        design = np.column_stack([truth.flat[near], np.ones(9)])
        found.append(np.array([*place, 1.0]) @ np.linalg.lstsq(design, scan.texture_xy[near])[0])
    return np.array(found)


def places_of(scan: RangeScan, truth: Truth, pixels: Floats) -> Floats:
    """Return the printed places (n, 2) mm that are seen at pixels (n, 2) of the colour image."""
    found = []
    for pixel in pixels:
        apart = np.hypot(*(scan.texture_xy - pixel).transpose(2, 0, 1))
        apart = np.where(np.isfinite(truth.flat[..., 0]), apart, np.inf)
        near = np.unravel_index(np.argsort(apart, axis=None)[:9], apart.shape)
        design = np.column_stack([scan.texture_xy[near], np.ones(9)])
        found.append(np.array([*pixel, 1.0]) @ np.linalg.lstsq(design, truth.flat[near])[0])
    return np.array(found)


def main() -> int:
    """Print the figures. Returns 1 when corrections are carried to another page."""
    parser = argparse.ArgumentParser(prog="python -m bench.rescan", description=__doc__)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    right = wrong = dropped = 0
    errors: list[float] = []
    for number in range(given.count):
        random = np.random.default_rng([given.seed, number])
        same = number % 3 < 2
        (one, truth_one), (two, truth_two) = (
            opening(random, 1000 * given.seed + 2 * number + other) for other in (0, 0 if same else 1)
        )
        move = motion_between(one, two)
        if move is None:
            dropped += same
            print(f"{number:4} {'same page' if same else 'another':10} dropped", flush=True)
            continue
        there = move(pixels_of(one, truth_one, PLACES_MM))
        apart = float(np.hypot(*(places_of(two, truth_two, there) - PLACES_MM).T).max())
        errors += [apart] if same else []
        right, wrong = right + (same and apart <= MAX_ERROR_MM), wrong + (not same)
        print(
            f"{number:4} {'same page' if same else 'another':10} carried, worst of its points {apart:.2f} mm",
            flush=True,
        )
    total = sum(number % 3 < 2 for number in range(given.count))
    print(f"same page: {right} of {total} within {MAX_ERROR_MM} mm, {dropped} dropped; another page: {wrong} carried")
    if errors:
        print(f"worst point of each: median {np.median(errors):.2f}, worst {max(errors):.2f} mm")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
