"""`python -m bench.structured_light [--seed S] [--sheets wave …] [--width 1600]`: pages from a camera and a projector.

Printed pages under a simulated projector are captured pattern by pattern, made a range image and restored. Depths are
compared with the exact surface. Every pixel of the page has a place in the camera's picture, and what lies there has an
exact place on the sheet before it was warped: the difference, after the best rigid motion and without scale, is the
error of the page. Sheets, print, rig and light are drawn from the seed, by default of today.
"""

from __future__ import annotations

import argparse

import numpy as np

from bench.draws import seed_of_today
from bench.layout import SHEETS
from drivers.simulated import Text
from drivers.simulated.scene.sheets import Sheet
from oracles.markers import rigid_residual
from oracles.simulation.projector import RigPlan, SimulatedRig, build_rig
from oracles.structured_light import captured, depth_errors, greys, rig_of
from restore import RestoredPage, Settings, restore
from restore.scan import Floats
from restore.structured_light import scan_captures
from restore.texture.page import MM_PER_INCH

MAX_PIXELS = 60_000  # of a page are compared
ROW = "{:<12} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}"
HEADINGS = ("sheet", "depth mm", "99 %", "page mm", "99 %", "size mm", "measured")


def main(seed: int | None = None, width: int = 1600, sheets: tuple[str, ...] = ()) -> None:
    """Print a line for each kind of sheet."""
    seed = seed or seed_of_today()
    print(
        f"\nstructured light, camera of {width} × {width * 3 // 4}, projector of 1280 × 800, seed {seed}; mm\n"
        "median and 99 % of the depth's error on the page, rms and 99 % of the page's, error of its width and height"
    )
    print(ROW.format(*HEADINGS), flush=True)
    for number, (kind, (_, draw)) in enumerate(SHEETS.items()):
        if not sheets or kind in sheets:
            rng = np.random.default_rng([seed, number])
            print(ROW.format(kind, *_measured(_drawn_rig(draw(rng), rng, width), rng)), flush=True)


def _drawn_rig(sheet: Sheet, rng: np.random.Generator, width: int) -> SimulatedRig:
    plan = RigPlan(
        size=(width, width * 3 // 4),
        distance_mm=rng.uniform(600, 900),
        baseline_mm=rng.uniform(180, 300),
        projector_deg=float(rng.choice([0.0, 90.0, 180.0])),
        view_mm=rng.uniform(380, 440),
        ambient=rng.uniform(0.02, 0.2),
        exposure=rng.uniform(0.5, 0.8),
        blur_px=rng.uniform(0.6, 1.0),
        focus_px=rng.uniform(0.3, 0.6),
        noise=rng.uniform(1.0, 3.0),
    )
    aim = (float(rng.uniform(-10, 10)), float(rng.uniform(-10, 10)))
    return build_rig(sheet, Text(sizes_pt=(10.0,), columns=2, seed=int(rng.integers(1000))), plan, aim_mm=aim)


def _measured(simulated: SimulatedRig, rng: np.random.Generator) -> tuple[str, ...]:
    pictures = captured(simulated, int(rng.integers(2**31)))
    scan = scan_captures(greys(pictures), pictures[-2], rig_of(simulated))
    error, places = depth_errors(scan, simulated)
    depth = np.abs(error[np.isfinite(places[:, 0])])
    page = restore(scan, Settings())
    off = np.linalg.norm(layout_error(page, simulated), axis=1)
    size = np.array(page.report["page_mm"]) - simulated.scene.printed.page_mm
    return (
        f"{np.median(depth):.3f}",
        f"{np.quantile(depth, 0.99):.3f}",
        f"{np.sqrt((off**2).mean()):.3f}",
        f"{np.quantile(off, 0.99):.3f}",
        "/".join(f"{side:+.1f}" for side in size),
        f"{scan.provenance['decoded_fraction']:.1%}",
    )


def layout_error(page: RestoredPage, simulated: SimulatedRig) -> Floats:
    """(k, 2) mm between pixels of the page and the true places on the sheet of what they show."""
    rows, cols = np.nonzero(np.isfinite(page.page_map[..., 0]))
    step = len(rows) // MAX_PIXELS + 1
    rows, cols = rows[::step], cols[::step]
    tangents = rig_of(simulated).camera.tangents(page.page_map[rows, cols].astype(float))
    _, true = simulated.points(tangents)
    known = np.isfinite(true).all(axis=1)
    found = np.stack([cols, -rows], axis=1) * MM_PER_INCH / page.dpi
    return rigid_residual(found[known], true[known])[0]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--width", type=int, default=1600)
    parser.add_argument("--sheets", nargs="+", choices=tuple(SHEETS), default=[])
    options = parser.parse_args()
    main(options.seed, options.width, tuple(options.sheets))
