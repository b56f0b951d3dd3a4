"""`python -m bench.random_shots [--count 20] [--seed S]`: whole pages from shots that nobody has chosen.

Sheet, print, table, lens, distance, mode, tilt, turn and the share of samples that are lost besides are drawn from the
seed, by default of today. Every pixel of the page is compared with its exact place on the sheet. A line that begins
with ! tells of a pixel that is off by more than a millimetre, of a size that is off by more than SIZE_MM, or of a
warning that has no cause.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from bench.draws import PRINTS, lossy, run, seed_of_today
from bench.layout import SHEETS
from bench.page_meshes import side_error
from drivers.simulated import Pose, Truth, shoot
from drivers.simulated.scene.artwork import ARTWORK
from drivers.simulated.scene.scene import Table
from drivers.vivid900.geometry.lenses import MODES
from oracles.layout import layout_error
from restore import RangeScan, RestoreError, Settings, restore

COUNT = 20
LENSES = {"MIDDLE": (900.0, 1150.0), "WIDE": (620.0, 800.0)}  # mm: distances at which a page fills half of the picture
TILT_DEG, TURN_DEG = 20.0, 180.0
LOST = (0.0, 0.0, 0.1, 0.3)  # of the samples
FAR_MM, SIZE_MM = 1.0, 0.15
CUT = "cut_off"  # the one finding that has a cause here: the page leaves the picture
ROW = "{:<1} {:>10} {:<12} {:<8} {:<6} {:>5} {:<5} {:<6} {:>5} {:>5} {:>5} {:>8} {:>8} {:>8}  {}"
HEADINGS = (
    *("", "seed", "sheet", "print", "table", "mode", "lens", "mm", "tilt", "turn", "lost"),
    *("rms mm", "most mm", "size mm", "findings"),
)


@dataclass(frozen=True, eq=False)
class Shot:
    """A scan, its truth, and how it was drawn: one entry for each heading from sheet to lost."""

    scan: RangeScan
    truth: Truth
    drawn: tuple[Any, ...]


def main(count: int = COUNT, seed: int | None = None) -> None:
    """Print a line for each shot, and how many are flagged."""
    seed = seed or seed_of_today()
    print(f"\n{count} random shots, seeds from {seed}")
    print(ROW.format(*HEADINGS))
    flagged = sum(_line(number, random_shot(number)) for number in range(seed, seed + count))
    print(f"flagged: {flagged} of {count}")


def random_shot(seed: int) -> Shot:
    """The shot of a seed."""
    rng = np.random.default_rng(seed)
    names = list(SHEETS), PRINTS, list(LENSES), get_args(Table), list(MODES)
    kind, artwork, lens, table, mode = (str(rng.choice(some)) for some in names)
    distance, lost = float(rng.uniform(*LENSES[lens])), float(rng.choice(LOST))
    pose = Pose(tilt_deg=rng.uniform(-TILT_DEG, TILT_DEG), turn_deg=rng.uniform(-TURN_DEG, TURN_DEG))
    options: dict[str, Any] = {"lens": lens, "distance_mm": distance, "mode": mode, "pose": pose, "table": table}
    scan, truth = shoot(SHEETS[kind][1](rng), ARTWORK[artwork](), seed=int(rng.integers(2**31)), **options)
    place = f"{distance:.0f}", f"{pose.tilt_deg:.0f}", f"{pose.turn_deg:.0f}"
    return Shot(lossy(scan, lost, rng), truth, (kind, artwork, table, mode, lens, *place, lost))


def _line(seed: int, shot: Shot) -> bool:
    """Print the line of a shot; whether it is flagged."""
    try:
        page = restore(shot.scan, Settings())
    except RestoreError as error:
        print(ROW.format("!", seed, *shot.drawn, "", "", "", error), flush=True)
        return True
    error = np.linalg.norm(layout_error(page, shot.scan, shot.truth), axis=1)
    size = side_error(page.report["page_mm"], shot.truth.page_mm)
    findings = [one.text for one in page.findings if one.code != CUT]
    whole = len(findings) == len(page.findings)
    flag = bool(error.max() > FAR_MM or (whole and size > SIZE_MM) or findings)
    figures = (f"{np.sqrt((error**2).mean()):.3f}", f"{error.max():.2f}", f"{size:.2f}" if whole else "cut")
    print(ROW.format("!" if flag else "", seed, *shot.drawn, *figures, "; ".join(findings)), flush=True)
    return flag


if __name__ == "__main__":
    run(main, __doc__, COUNT)
