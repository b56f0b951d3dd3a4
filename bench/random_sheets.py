"""`python -m bench.random_sheets [--count 500]`: 500 random developable sheets, kind by kind."""

from __future__ import annotations

import argparse
import time
from collections import Counter

import numpy as np

from oracles.outcome import MAX_STRAIN, Outcome, flatten_and_compare
from oracles.random_sheets import NOISE_MM, POINTS, random_sheet

COUNT = 500
ROW = "{:<10}{:>7}{:>8}{:>9}{:>10}{:>13}{:>13}{:>10}{:>10}"


def main(count: int = COUNT) -> None:
    """Print the outcome of the sheets of all seeds below `count`, kind by kind."""
    start = time.perf_counter()
    print(f"\n{count} random developable sheets, {POINTS[0]} to {POINTS[1]} points, noise up to {NOISE_MM} mm")
    outcomes = [flatten_and_compare(random_sheet(seed)) for seed in range(count)]
    print(
        ROW.format(
            "sheet", "count", "failed", "flipped", "overlaps", "worst strain", "above bound", "median", "worst mm"
        )
    )
    kinds = sorted({o.sheet.kind for o in outcomes})
    for kind in [*kinds, "all"]:
        print(_line(kind, [o for o in outcomes if kind in (o.sheet.kind, "all")]))
    for o in outcomes:
        if not o.acceptable:
            s = o.sheet
            print(f"seed {s.seed} {s.kind} {s.outline} {len(s.flat)} points, noise {s.noise_mm:.2f}: {o.failed}")
            print(f"  flips {o.flips}, overlaps {o.overlaps}, strain {o.strain:.4f}, rms {o.rms_mm:.3f} mm")
    print(f"bound of the strain {MAX_STRAIN}; {time.perf_counter() - start:.0f} s")


def _line(kind: str, outcomes: list[Outcome]) -> str:
    faults = Counter[str]()
    for o in outcomes:
        faults.update(failed=bool(o.failed), flips=o.flips, overlaps=o.overlaps, strained=o.strain > MAX_STRAIN)
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


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT)
    main(parser.parse_args().count)
