"""How long the springs take to get as near to their lengths as the sticks do, with the same lengths.

Left to themselves they stop earlier; here they go on.
"""

from __future__ import annotations

import statistics
from unittest import mock

import numpy as np

from bench.paper import SEED, TABLE_2
from bench.timing import in_turns
from oracles.exact import exact_sheet
from restore.flattening.published import springs
from restore.flattening.published.springs import flatten_springs
from restore.flattening.published.sticks import flatten_sticks
from restore.mesh.measures import edge_strain
from restore.scan import Floats

LONGEST = 4000  # steps; by themselves the springs stop after 300 to 800, when the area has stopped changing
WANTED = 16.0  # the best of the paper's figures (Fig. 7: about 50 s against 3.13 s)


def main() -> None:
    """Print the times and their ratio, sheet by sheet."""
    print("\nsprings to the strain of the sticks, same lengths; > where they end above it")
    row = "{:<14}{:>7}{:>11}{:>10}{:>11}{:>11}{:>9}"
    print(row.format("sheet", "points", "strain", "sticks s", "springs s", "strain", "ratio"))
    ratios = []
    for name, (sheet, points, _) in TABLE_2.items():
        warped = exact_sheet(sheet, points, seed=SEED)
        posed, network = warped.posed(), warped.network()
        flat = flatten_sticks(posed, network).flat
        wanted = _rms(flat, network.edges, network.lengths)
        seen: list[float] = []

        def look(_: int, now: Floats, network=network, seen=seen) -> None:
            seen.append(_rms(now[:, :2], network.edges, network.lengths))

        with mock.patch.multiple(springs, QUIET_STEPS=np.inf, MAX_STEPS=LONGEST):
            flatten_springs(posed, network, look)
        reached = next((step for step, strain in enumerate(seen, 1) if strain <= wanted), None)
        with mock.patch.multiple(springs, QUIET_STEPS=np.inf, MAX_STEPS=reached or LONGEST):
            ours, theirs = in_turns(
                lambda posed=posed, network=network: flatten_sticks(posed, network),
                lambda posed=posed, network=network: flatten_springs(posed, network),
            )
        ratios.append(theirs / ours)
        at = f"{seen[reached - 1 if reached else -1]:.1e}"
        ratio = f"{'' if reached else '>'}{ratios[-1]:.0f}"
        print(row.format(name, points, f"{wanted:.1e}", f"{ours:.4f}", f"{theirs:.4f}", at, ratio), flush=True)
    verdict = "yes" if min(ratios) >= WANTED else "no"
    print(f"median {statistics.median(ratios):.0f}, least {min(ratios):.0f}; ", end="")
    print(f"at least {WANTED:.0f} on every sheet: {verdict}")


def _rms(flat: Floats, edges: np.ndarray, lengths: Floats) -> float:
    return float(np.sqrt(np.mean(edge_strain(flat, edges, lengths) ** 2)))


if __name__ == "__main__":
    main()
