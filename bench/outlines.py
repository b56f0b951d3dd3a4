"""`python -m bench.outlines [--count 4] [--seed 0] [--mode fine]`: a page that is corrected by hand, drawn ±0.5 mm off.

A finger that reaches over the edge, a corner that is torn off, a page on a table as white as itself and 0.3 mm below:
an outline round the paper, and a mask over the finger. Errors of the page's size, and of the area that is reported as
removed (the finger) or as missing (the corner), as a fraction of that area as it was drawn.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from drivers.simulated import Binding, Curl, Flat, Pose, Text, Truth
from drivers.simulated.imaging.shot import printed, shoot_scene
from drivers.simulated.scene.scene import place_sheet
from drivers.simulated.scene.sheets import Sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES, MODES
from oracles.hand import Drawing, draw, lay_finger, outline_uv, tear_corner
from restore import CoverageClass, PageEdits, PartEdits, RangeScan, Settings, restore_leaves
from restore.texture.page import MM_PER_INCH

PAGE_MM, DISTANCE_MM = (200.0, 140.0), 900.0
GAP_MM = {"finger": 3.0, "corner": 3.0, "white": 0.3}
CORNER_MM = 80.0  # of the page, that holds the tear: its other edges are off by what the hand is off
HAND_MM = 0.5  # by which each point that a hand draws is off, at most, across and along
SETTINGS = Settings(dpi=150)

Random = np.random.Generator


def main(count: int, seed: int, mode: Literal["fast", "fine"]) -> None:
    """Print a line for each page, then the worst of each kind."""
    worst: dict[str, list[float]] = {kind: [0.0, 0.0] for kind in DRAWN}
    for number in range(seed, seed + count):
        for kind, draw_on in DRAWN.items():
            random = np.random.default_rng([number, 64])
            size, area = _errors(*_shoot(kind, random, number, mode), draw_on, random)
            worst[kind] = [max(worst[kind][0], size), max(worst[kind][1], area)]
            print(f"{number:5} {kind:7} size off by {size:.2f} mm, area by {area:.1%}", flush=True)
    for kind, (size, area) in worst.items():
        print(f"{kind:7} worst: size {size:.2f} mm, area {area:.1%}")


def _shoot(kind: str, random: Random, seed: int, mode: str) -> tuple[RangeScan, Truth]:
    sheets: Mapping[str, Sheet] = {
        "finger": Curl(float(random.uniform(150, 400))),
        "corner": Binding(slope_deg=float(random.uniform(15, 40))),
        "white": Flat(),
    }
    optics = LENSES["MIDDLE"]
    scene = place_sheet(
        sheets[kind],
        printed(Text(seed=seed, title_pt=18.0, sizes_pt=(12.0,), margin_mm=12.0), PAGE_MM),
        depth_mm=DISTANCE_MM + optics.pupil_mm,
        pose=Pose(tilt_deg=float(random.uniform(-4, 4)), turn_deg=float(random.uniform(-4, 4))),
        table="white" if kind == "white" else "dark",
        gap_mm=GAP_MM[kind],
    )
    return shoot_scene(scene, nominal(optics), MODES[mode], DISTANCE_MM, np.random.default_rng(seed))


class ByHand(NamedTuple):
    """A scan with what a hand drew on it. area: of the drawing on the sheet, mm²; None where it removes nothing."""

    scan: RangeScan
    outline: Drawing
    mask: Drawing | None = None
    area: float | None = None


Draw = Callable[[RangeScan, Truth, Random], ByHand]


def _errors(scan: RangeScan, truth: Truth, draw_on: Draw, random: Random) -> tuple[float, float]:
    """Error of the page's size, mm, and of the area that was drawn, as a fraction of it."""
    by_hand = draw_on(scan, truth, random)
    masks = () if by_hand.mask is None else ({"what": "remove", "polygon": by_hand.mask.polygon},)
    part: dict[str, Any] = {"outline": by_hand.outline.polygon, "masks": masks}
    edits = PageEdits(layout="whole", parts={"page": PartEdits(**part)})
    page = restore_leaves(by_hand.scan, SETTINGS, edits=edits).parts["page"]
    size = float(np.abs(np.array(page.report["page_mm"]) - PAGE_MM).max())
    if by_hand.area is None:
        return size, 0.0
    reported = page.coverage == CoverageClass.ERASED
    if by_hand.mask is None:
        box = round(CORNER_MM * page.dpi / MM_PER_INCH)
        reported = page.coverage[:box, -box:] == CoverageClass.OUTSIDE
    area = np.count_nonzero(reported) * (MM_PER_INCH / page.dpi) ** 2
    return size, abs(area - by_hand.area) / by_hand.area


def _finger(scan: RangeScan, truth: Truth, random: Random) -> ByHand:
    touched, finger = lay_finger(scan, truth, random)
    mask = draw(scan, truth, finger, random, HAND_MM)
    return ByHand(touched, draw(scan, truth, outline_uv(PAGE_MM), random, HAND_MM), mask, mask.on_paper_mm2(PAGE_MM))


def _corner(scan: RangeScan, truth: Truth, random: Random) -> ByHand:
    torn, tear = tear_corner(scan, truth, random)
    outline = draw(scan, truth, outline_uv(PAGE_MM, tear), random, HAND_MM)
    ends = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]) * CORNER_MM
    box = np.array([PAGE_MM]) - CORNER_MM + np.array([[0.0, 0.0], *ends])
    left = outline.on_paper_mm2(PAGE_MM, within=box)
    return ByHand(torn, outline, area=CORNER_MM**2 - left)


def _white(scan: RangeScan, truth: Truth, random: Random) -> ByHand:
    return ByHand(scan, draw(scan, truth, outline_uv(PAGE_MM), random, HAND_MM))


DRAWN: Mapping[str, Draw] = {"finger": _finger, "corner": _corner, "white": _white}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mode", choices=["fast", "fine"], default="fine")
    main(**vars(parser.parse_args()))
