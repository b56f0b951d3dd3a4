"""`python -m bench.spreads [--count 12] [--seed 0] [--mode fast]`: spines of four families of openings, other sheets.

Openings have exponential, spline, stepped and cradled profiles; every fifth has a plate across its spine. For each, the
error of the spine on the paper, and of the widths of its leaves; the last lines count what was split, asked and kept.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping
from typing import Literal

import numpy as np

from drivers.simulated import Truth
from oracles.leaf_sides import boxes_cut, inner_edge, printed_boxes
from oracles.openings import Drawn, draw_opening, draw_other, shoot_drawn
from restore import LayoutFinding, RangeScan, RestoredPage, Settings, find_layout, restore_leaves
from restore.scan import Floats

PLATES = 5  # every fifth opening has one
SETTINGS = Settings(points=500, dpi=100)


def main(count: int, seed: int, mode: Literal["fast", "fine"]) -> None:
    """Print a line for each sheet, then the figures of all."""
    counts: dict[str, Counter[str]] = {kind: Counter() for kind in ("opening", "plate", "other")}
    spines: list[float] = []
    widths: list[float] = []
    cut = 0
    for number in range(seed, seed + count):
        plate = number % PLATES == PLATES - 1
        for kind, drawn in (
            ("plate" if plate else "opening", draw_opening(number, plate=plate)),
            ("other", draw_other(number)),
        ):
            shot = shoot_drawn(drawn, number, mode)
            if shot is None:
                continue
            scan, truth = shot
            finding = find_layout(scan)
            counts[kind][finding.advice] += 1
            line = f"{number:5} {drawn.family:12} {kind:8} {finding.advice:6} {finding.is_spine:7}"
            if drawn.spine_mm is not None and finding.spine is not None and not finding.gutter_hidden_mm:
                spines.append(_spine_error(finding, scan, truth, drawn.spine_mm))
                line += f" spine {spines[-1]:+.2f} mm"
            if finding.advice == "split" and drawn.spine_mm is not None:
                leaves = dict(restore_leaves(scan, SETTINGS, layout="split").parts())
                widths += _width_errors(leaves, drawn)
                cut += words_cut(leaves, scan, truth)
                line += f" widths {widths[-2]:+.2f} {widths[-1]:+.2f} mm"
            print(line, flush=True)
    for kind, advice in counts.items():
        print(f"{kind:8} {dict(advice)}")
    print(f"words cut: {cut}, other sheets cut: {counts['other']['split']}")
    for name, errors in (("spine", spines), ("width", widths)):
        if errors:
            size = np.abs(errors)
            print(
                f"{name}: median {np.median(size):.2f}, 95 % {np.quantile(size, 0.95):.2f}, worst {size.max():.2f} mm"
            )


def _spine_error(finding: LayoutFinding, scan: RangeScan, truth: Truth, spine_mm: float) -> float:
    """Median error on the paper, mm, of the middle of a spine."""
    assert finding.spine is not None
    rows, cols = np.indices(scan.measured.shape)
    design = np.column_stack([scan.texture_xy.reshape(-1, 2), np.ones(rows.size)])
    to_grid: Floats = np.linalg.lstsq(design, np.column_stack([rows.ravel(), cols.ravel()]))[0]
    errors = []
    for part in np.linspace(0.1, 0.9, 9):
        at = [np.interp(part, np.linspace(0, 1, len(finding.spine)), finding.spine[:, k]) for k in (0, 1)]
        row, col = np.array([*at, 1.0]) @ to_grid
        across = truth.flat[round(row), :, 0]
        known = np.flatnonzero(np.isfinite(across))
        errors.append(float(np.interp(col, known, across[known])) - spine_mm)
    return float(np.median(errors))


def words_cut(leaves: Mapping[str, RestoredPage], scan: RangeScan, truth: Truth) -> int:
    """Return how many words, and fields of a picture, are whole on neither leaf."""
    edges = {side: inner_edge(page, scan, truth, side) for side, page in leaves.items() if side != "page"}
    return boxes_cut(printed_boxes(truth.printed), edges)


def _width_errors(leaves: Mapping[str, RestoredPage], drawn: Drawn) -> list[float]:
    """Errors of the widths of both leaves, mm, without the strip of the facing page."""
    assert drawn.spine_mm is not None
    true = {"left": drawn.spine_mm, "right": drawn.page_mm[0] - drawn.spine_mm}
    reports = {side: leaves[side].report for side in true}
    return [float(reports[side].get("leaf_mm", reports[side]["page_mm"])[0] - true[side]) for side in true]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mode", choices=["fast", "fine"], default="fast")
    main(**vars(parser.parse_args()))
