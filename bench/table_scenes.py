"""`python -m bench.table_scenes [--count 60] [--seed S]`: which samples are the page's, with and without a table.

Sheet, print, table, its distance below the page, laser power, lens, distance, tilt, turn, place in the picture, samples
lost besides and whether the scan has colour are drawn from the seed, by default of today. A scene without a table is
filled by its page. A line is printed for a page that lost more than WRONG of its samples, or has as many that are not
its own, with its findings; at last how many scenes of each table there are, and how many are wrong, and without a word.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any, NamedTuple, get_args

import numpy as np

from bench.draws import PRINTS, lossy, run, seed_of_today
from bench.layout import SHEETS
from drivers.scanner import SettingsError
from drivers.simulated import Flat, Pose
from drivers.simulated.imaging.shot import printed, shoot_scene
from drivers.simulated.scene.artwork import ARTWORK
from drivers.simulated.scene.scene import Table, place_sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES, MODES
from restore import RangeScan, RestoreError
from restore.camera.rays import find_rays
from restore.range_image.segmentation.segment import find_sheet
from restore.scan import Mask

COUNT = 60
WRONG = 0.01  # of the page's samples; its outermost rows and columns have as many each
GAPS_MM = (0.1, 0.3, 1.0, 3.0, 8.0)
POWERS = (1.0, 1.0, 0.4, 0.15)  # of the laser: a dark table gives hardly any range with the least
ON_TABLE = (("MIDDLE", 900.0, (280.0, 200.0)), ("MIDDLE", 1100.0, (280.0, 200.0)))
FILLING = (*ON_TABLE[:1], ("TELE", 900.0, (280.0, 200.0)), ("MIDDLE", 900.0, (420.0, 300.0)))
ASIDE_MM = (60.0, 40.0)  # of a page that leaves the picture, at most
LOST = (0.0, 0.0, 0.0, 0.3)  # of the samples
ROW = "{:<11} {:<12} {:<8} {:<6} {:>4} {:>5} {:>4} {:>7} {:>7}  {}"
HEADINGS = ("seed", "sheet", "print", "table", "gap", "power", "lost", "missing", "foreign", "")


class SceneShot(NamedTuple):
    """A scan, (rows, cols) True for samples on its page, and how it was drawn: one entry for each heading."""

    scan: RangeScan
    on_page: Mask
    drawn: tuple[Any, ...]


def main(count: int = COUNT, seed: int | None = None) -> None:
    """Print a line for each scene that is wrong, and the counts."""
    seed = seed or seed_of_today()
    print(f"\n{count} scenes, seeds from {seed}")
    print(ROW.format(*HEADINGS))
    drawn, wrong, silent = Counter[str](), Counter[str](), 0
    for number in range(seed, seed + count):
        shot = scene_shot(number)
        if shot is not None:
            drawn[shot.drawn[2]] += 1
            said = _said(number, shot)
            wrong[shot.drawn[2]] += said is not None
            silent += said == ""
    print(
        "wrong: "
        + ", ".join(f"{wrong[table]} of {drawn[table]} ({table})" for table in sorted(drawn))
        + f"; silent: {silent}"
    )


def scene_shot(seed: int) -> SceneShot | None:
    """The shot of a seed; None for a sheet that folds over itself in its pose."""
    rng = np.random.default_rng(seed)
    kind = str(rng.choice(["flat", *SHEETS]))
    artwork, table = str(rng.choice(PRINTS)), str(rng.choice(get_args(Table)))
    sheet = Flat() if kind == "flat" else SHEETS[kind][1](rng)
    gap, power, lost = (float(rng.choice(some)) for some in (GAPS_MM, POWERS, LOST))
    kinds = FILLING if table == "none" else ON_TABLE
    name, distance, page_mm = kinds[int(rng.integers(len(kinds)))]
    lens, mode = LENSES[name], MODES[str(rng.choice(list(MODES)))]
    aside = (rng.random() < 0.3) * rng.uniform(-1.0, 1.0, 2) * ASIDE_MM
    turn = rng.uniform(-90.0, 90.0) if distance > 1000.0 or table == "none" else rng.uniform(-5.0, 5.0)
    pose = Pose(tilt_deg=rng.uniform(-15.0, 15.0), turn_deg=turn, shift_mm=(float(aside[0]), float(aside[1]), 0.0))
    depth = distance + lens.pupil_mm
    print_ = printed(ARTWORK[artwork](), page_mm)
    try:
        scene = place_sheet(sheet, print_, depth_mm=depth, pose=pose, table=table, gap_mm=gap)  # type: ignore[arg-type]
        scan, truth = shoot_scene(scene, nominal(lens), mode, distance, rng, exposure=power)
    except SettingsError:
        return None
    scan, coloured = lossy(scan, lost, rng), rng.random() > 0.2
    scan = scan if coloured else replace(scan, texture=None)
    place = f"{mode.name}, {name}, {distance:.0f} mm, turned {turn:.0f}°" + ("" if coloured else ", no colour")
    return SceneShot(scan, np.isfinite(truth.flat[..., 0]), (kind, artwork, table, gap, power, lost, place))


def _said(seed: int, shot: SceneShot) -> str | None:
    """Print the line of a shot that is wrong. Returns its findings, None where it is right."""
    *drawn, place = shot.drawn
    own = shot.scan.measured & shot.on_page
    try:
        rays = find_rays(shot.scan)
        sheet = None if rays is None else find_sheet(shot.scan, rays)
    except RestoreError as error:
        print(ROW.format(seed, *drawn, "", "", f"{place}: {error}"), flush=True)
        return str(error)
    missing = 1.0 if sheet is None else (own & ~sheet.inside).sum() / max(own.sum(), 1)
    foreign = 0.0 if sheet is None else (sheet.samples & ~shot.on_page).sum() / max(own.sum(), 1)
    if max(missing, foreign) <= WRONG:
        return None
    said = "" if sheet is None else ", ".join(one.code for one in sheet.scan.findings)
    print(ROW.format(seed, *drawn, f"{missing:.1%}", f"{foreign:.1%}", f"{place}: {said or 'silent'}"), flush=True)
    return said


if __name__ == "__main__":
    run(main, __doc__, COUNT)
