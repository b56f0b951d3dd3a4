"""`python -m bench.leaf_maps [--count 8] [--seed 0] [--mode fast]`: two leaves against the whole of the same scan.

For each opening, root mean square error of the layout at every pixel against the true sheet, mm: of the whole, of the
left and the right leaf. The errors of the widths, and processor time of the leaves as a multiple of the whole's.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from time import process_time
from typing import Literal, TypeVar

import numpy as np

from drivers.simulated import shoot
from oracles.layout import layout_error
from oracles.openings import draw_opening, shoot_drawn
from restore import RestoredPage, Settings, restore, restore_leaves

SETTINGS = Settings(points=1000, dpi=150)  # of the preset for books
Result = TypeVar("Result")


def main(count: int, seed: int, mode: Literal["fast", "fine"]) -> None:
    """Print a line for each opening, then the medians and the worst."""
    ratios: list[float] = []
    seconds: list[tuple[float, float]] = []
    widths: list[float] = []
    _warm_up()
    for number in range(seed, seed + count):
        drawn = draw_opening(number)
        assert drawn.spine_mm is not None
        shot = shoot_drawn(drawn, number, mode)
        if shot is None:
            print(f"{number:5} {drawn.family:12} folds over itself", flush=True)
            continue
        scan, truth = shot
        whole, whole_s = _timed(lambda shot=scan: restore(shot, SETTINGS))
        leaves, leaves_s = _timed(lambda shot=scan: restore_leaves(shot, SETTINGS, layout="split"))
        rms = _rms(layout_error(whole, scan, truth))
        of_leaves = {side: _rms(layout_error(leaves.parts[side], scan, truth)) for side in ("left", "right")}
        true = {"left": drawn.spine_mm, "right": drawn.page_mm[0] - drawn.spine_mm}
        wide = [_width(leaves.parts[side]) - true[side] for side in true]
        ratios += [one / rms for one in of_leaves.values()]
        widths += wide
        seconds.append((whole_s, leaves_s))
        errors = f"whole {rms:.3f} left {of_leaves['left']:.3f} right {of_leaves['right']:.3f} mm"
        cost = f"{leaves_s:.2f} s / {whole_s:.2f} s = {leaves_s / whole_s:.2f}"
        print(f"{number:5} {drawn.family:12} {errors}, widths {wide[0]:+.2f} {wide[1]:+.2f} mm, {cost}", flush=True)
    if ratios:
        print(f"rms of a leaf / of the whole: median {np.median(ratios):.2f}, worst {max(ratios):.2f}")
        print(f"widths: median {np.median(np.abs(widths)):.2f}, worst {np.abs(widths).max():.2f} mm")
        whole_all, leaves_all = np.sum(seconds, axis=0)
        print(f"processor time: {leaves_all / whole_all:.2f} × the whole's")


def _warm_up() -> None:
    """Compile what the first opening would wait for."""
    drawn = draw_opening(0)
    scan, _ = shoot(drawn.sheet, drawn.artwork, page_mm=drawn.page_mm, mode="fast")
    restore_leaves(scan, SETTINGS, layout="split")


def _timed(work: Callable[[], Result]) -> tuple[Result, float]:
    start = process_time()
    return work(), process_time() - start


def _rms(error: np.ndarray) -> float:
    return float(np.sqrt((error**2).sum(axis=1).mean()))


def _width(page: RestoredPage) -> float:
    return float(page.report.get("leaf_mm", page.report["page_mm"])[0])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mode", choices=["fast", "fine"], default="fast")
    main(**vars(parser.parse_args()))
