"""`python -m bench.uncertainty [--count 5] [--seed S] [--log FILE]`: stated uncertainties next to exact errors.

Sheet, pose, distance, lens, mode and noise (half to twice the scanner's) of a page are drawn from its seed. Places 5 mm
apart are compared with their exact places on the sheet after the best rigid motion; the error along either axis is
counted in stated standard deviations. Pages are appended to the log, one line of JSON each, and seeds that it holds are
not run again: a run that was ended continues, and the summary is of all pages in the log. `--bodies N` counts instead
how many of N pages have the size that their interval says: scanned by a body that deviates, by the manual's figures and
after a calibration.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates
from scipy.stats import spearmanr

from bench.calibration import scan_boards
from bench.draws import draws_parser, seed_of_today
from drivers.simulated import Binding, Cone, Crumpled, Curl, Flat, Miura, MultiFold, Pose, Spread, Wave, shoot
from drivers.simulated.imaging.optics import exact_pitch
from drivers.simulated.imaging.shot import expose_scene, printed
from drivers.simulated.scene.artwork import Markers
from drivers.simulated.scene.scene import place_sheet
from drivers.simulated.scene.sheets import Sheet
from drivers.vivid900.geometry.calibration import nominal, read_calibration
from drivers.vivid900.geometry.lenses import LENSES, MODES, texture_grid
from drivers.vivid900.geometry.triangulation import points_of
from oracles.hidden_body import HIDDEN_BODY
from oracles.markers import rigid_residual
from restore import RangeScan, RestoreError, Settings, restore
from restore.outline.rectangle import page_size
from restore.prepared.prepare import prepare
from restore.scan import Floats
from restore.texture.page import MM_PER_INCH, page_map, sampling_ppi
from restore.uncertainty.calibration import edge_error
from restore.uncertainty.estimate import PITCH_MM, Uncertainty, estimate_uncertainty
from station.cli import main as planish

COUNT = 5
PAGE_MM = (160.0, 120.0)
DISTANCES = {"MIDDLE": (750.0, 1000.0), "WIDE": (560.0, 700.0)}
TILT_DEG = 20.0
NOISE = (0.5, 2.0)  # of the scanner's
FAST_FRACTION = 0.7  # of the pages
BORDER_MM = 8.0
SIGMAS = (1.0, 2.0, 3.0)


def _sheets(rng: np.random.Generator) -> dict[str, Sheet]:
    """One of each kind."""
    creases = tuple(
        (place + float(rng.uniform(-6, 6)), float(rng.uniform(-15, 15)), turn * float(rng.uniform(20, 45)))
        for place, turn in ((-35.0, 1.0), (25.0, -1.0))
    )
    return {
        "curl": Curl(radius_mm=rng.uniform(75, 200), taper=rng.uniform(-0.2, 0.2), angle_deg=rng.uniform(-40, 40)),
        "wave": Wave(slope_deg=rng.uniform(12, 30), wavelength_mm=rng.uniform(70, 150), angle_deg=rng.uniform(0, 90)),
        "cone": Cone(apex_mm=rng.uniform(280, 600), opening_deg=rng.uniform(20, 40)),
        "binding": Binding(),
        "brochure": MultiFold(creases=creases),
        "Miura": Miura(fold_deg=rng.uniform(12, 30), side_mm=rng.uniform(36, 60)),
        "spread": Spread(slope_deg=rng.uniform(50, 66), reach_mm=rng.uniform(16, 28)),
        "crumpled": Crumpled(tilt_deg=rng.uniform(5, 10), seed=int(rng.integers(1000))),
    }


def measured_page(seed: int) -> dict[str, Any]:
    """The page of a seed: how it was drawn, what is stated, and what is true."""
    rng = np.random.default_rng(seed)
    sheets = _sheets(rng)
    kind, lens = str(rng.choice(list(sheets))), str(rng.choice(list(DISTANCES)))
    mode = "fast" if rng.random() < FAST_FRACTION else "fine"
    distance, noise = float(rng.uniform(*DISTANCES[lens])), float(np.exp(rng.uniform(*np.log(NOISE))))
    pose = Pose(tilt_deg=rng.uniform(-TILT_DEG, TILT_DEG), turn_deg=rng.uniform(-TILT_DEG, TILT_DEG))
    scan, flat = noisy_scan(sheets[kind], lens, mode, distance, pose, noise, rng)
    drawn = {"seed": seed, "sheet": kind, "lens": lens, "mode": mode, "distance": distance, "noise_factor": noise}
    return {**drawn, **compared(scan, flat)}


def noisy_scan(
    sheet: Sheet, lens: str, mode: str, distance: float, pose: Pose, noise: float, rng: np.random.Generator
) -> tuple[RangeScan, Floats]:
    """A shot whose noise is multiplied, and the true places (rows, cols, 2) mm of its samples on the sheet."""
    optics, kind = LENSES[lens], MODES[mode]
    body = nominal(optics)
    scene = place_sheet(
        sheet, printed(Markers(), PAGE_MM), depth_mm=distance + optics.pupil_mm, pose=pose, table="dark", light=None
    )
    taken = expose_scene(scene, body, kind, distance, rng)
    exact = exact_pitch(taken.hits, body, kind, distance)
    points = points_of(exact + noise * (taken.pitch - exact), body, kind, distance)
    facts = {"device": "simulated Vivid 900", "lens": lens, "distance_mm": distance, "mode": kind.name}
    scan = RangeScan(points, taken.texture, texture_grid(kind), {**facts, "calibration": body.as_json()})
    return scan, taken.hits.flat


def compared(scan: RangeScan, flat: Floats) -> dict[str, Any]:
    """Uncertainties stated for a page, and the exact errors of its places."""
    prepared = prepare(scan)
    page = prepared.unroll(Settings(), lambda _: nullcontext())
    start = process_time()
    stated = estimate_uncertainty(prepared, page, scan)
    seconds = process_time() - start
    if isinstance(stated, str):
        raise TypeError(stated)
    errors, known = exact_errors(page.fine, scan, flat)
    size_off = np.subtract(page_size(page.fine.flat[page.fine.topology.border]), PAGE_MM)
    edges = edge_error(sampling_ppi(page.fine.flat, page.fine.faces, page.fine.texcoords))
    size = {"size_off": size_off.tolist(), "size_stated": np.hypot(stated.sides, edges).tolist()}
    return {**figures(stated, errors, known), **size, "seconds": seconds}


def exact_errors(fine: Any, scan: RangeScan, flat: Floats) -> tuple[Floats, Floats]:
    """(n, 2) mm errors of the places of a page that are known, and where those are (h, w) on the grid of PITCH_MM."""
    pixels = page_map(fine.flat, fine.faces, fine.texcoords, MM_PER_INCH / PITCH_MM).astype(np.float64)
    first, last = scan.texture_xy[0, 0], scan.texture_xy[-1, -1]
    grid = (pixels - first) / (last - first) * (np.array(scan.points.shape[1::-1]) - 1)
    places = np.moveaxis(np.nan_to_num(grid, nan=-1.0)[..., ::-1], -1, 0)
    true = np.stack([map_coordinates(flat[..., k], places, order=1, cval=np.nan) for k in (0, 1)], axis=-1)
    known = np.isfinite(true).all(axis=2)
    rows, cols = np.nonzero(known)
    found = np.stack([cols, -rows], axis=1) * PITCH_MM
    return rigid_residual(found, true[known])[0], known


def figures(stated: Uncertainty, errors: Floats, known: Floats) -> dict[str, Any]:
    """Fractions of errors (n, 2) mm within stated deviations, and both rms."""
    total, noise = stated.total[known], stated.noise[known]
    padded = distance_transform_edt(np.pad(known, 1))[1:-1, 1:-1]
    border = padded[known] * PITCH_MM <= BORDER_MM
    within = np.abs(errors) / total[:, None]
    return {
        "places": len(errors),
        "actual": float(np.sqrt((errors**2).mean())),
        "stated": float(np.sqrt((total**2).mean())),
        "stated_noise": float(np.sqrt((noise**2).mean())),
        "within": [float((within < sigma).mean()) for sigma in SIGMAS],
        "noise_alone": [float((np.abs(errors) < sigma * noise[:, None]).mean()) for sigma in SIGMAS],
        "border": float((within[border] < 2.0).mean()),
        "rank": float(spearmanr(total, np.linalg.norm(errors, axis=1))[0]),
    }


def summary(pages: Sequence[Mapping[str, Any]]) -> list[str]:
    """Lines about all pages."""
    refused = [page["seed"] for page in pages if "error" in page]
    pages = [page for page in pages if "error" not in page]
    if not pages:
        return [f"no page was restored; refused: {refused}"]
    ratio = np.array([page["stated"] / page["actual"] for page in pages])
    rank = spearmanr([page["stated"] for page in pages], [page["actual"] for page in pages])[0]
    pooled = np.average([page["within"] for page in pages], axis=0, weights=[page["places"] for page in pages])
    alone = np.average([page["noise_alone"] for page in pages], axis=0, weights=[page["places"] for page in pages])
    least = min(page["within"][1] for page in pages)
    sizes = np.abs([np.divide(page["size_off"], page["size_stated"]) for page in pages])
    by_mode = {mode: max((page["seconds"] for page in pages if page["mode"] == mode), default=np.nan) for mode in MODES}
    return [
        f"{len(pages)} pages, refused {refused}; within 1, 2, 3 standard deviations: {pooled.round(3).tolist()} "
        f"(noise alone {alone.round(3).tolist()})",
        f"within 2 on each page at least {least:.3f} (noise alone {min(p['noise_alone'][1] for p in pages):.3f}), at "
        f"borders {min(p['border'] for p in pages):.3f}, in the mean {np.mean([p['border'] for p in pages]):.3f}",
        f"stated over actual rms: {ratio.min():.2f} to {ratio.max():.2f}, median {np.median(ratio):.2f}; rank over "
        f"pages {rank:.3f}, within a page {np.median([p['rank'] for p in pages]):.2f} in the median",
        f"sizes within 2 standard deviations: {(sizes < 2.0).mean():.3f}, off by {np.median(sizes):.2f} of one in the "
        f"median; processor time, most: {by_mode}",
    ]


def main(count: int, seed: int, log: Path | None) -> None:
    """Print a line for each page, and the summary."""
    pages = read_log(log)
    known = {page["seed"] for page in pages}
    for number in (one for one in range(seed, seed + count) if one not in known):
        try:
            page = measured_page(number)
        except RestoreError as error:
            page = {"seed": number, "error": str(error)}
        pages.append(page)
        line = json.dumps(page)
        if log:
            with log.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        print(line, flush=True)
    print("\n".join(summary(pages)))


def read_log(log: Path | None) -> list[dict[str, Any]]:
    """Return the pages of a log; none without one."""
    return [json.loads(line) for line in log.read_text("utf-8").splitlines()] if log and log.exists() else []


def flat_page_noise(seed: int) -> float:
    """rms of the stated uncertainty of a flat page, mm: no floor may be added to it."""
    rng = np.random.default_rng(seed)
    scan, flat = noisy_scan(Flat(), "MIDDLE", "fast", 900.0, Pose(), 1.0, rng)
    return float(compared(scan, flat)["stated"])


def bodies(count: int, seed: int) -> None:
    """Print how many pages of a body that deviates have the size that is stated."""
    with TemporaryDirectory() as folder:
        board, file = Path(folder), Path(folder) / "body.calibrated.toml"
        if planish(["calibrate", *scan_boards(board), "-o", str(file)]):
            raise RuntimeError("the calibration failed")
        known = {"nominal": nominal(LENSES["MIDDLE"]), "calibrated": read_calibration(file)}
    for name, calibration in known.items():
        right, widest = 0, 0.0
        for number in range(seed, seed + count):
            rng = np.random.default_rng(number)
            sheet = _sheets(rng)[("curl", "wave", "cone")[number % 3]]
            pose = Pose(tilt_deg=rng.uniform(-10, 10), turn_deg=rng.uniform(-10, 10))
            options: dict[str, Any] = {"mode": "fast", "pose": pose, "page_mm": PAGE_MM, "seed": number}
            scan, _ = shoot(sheet, body=HIDDEN_BODY, calibration=calibration, **options)
            report = restore(scan, Settings(dpi=60)).report
            off = np.abs(np.array(report["page_mm"]) - PAGE_MM)
            right += bool((off <= report["size_mm_ci95"]).all())
            widest = max(widest, float((off / report["size_mm_ci95"]).max()))
        print(f"{name}: {right} of {count} pages within their interval, at most {widest:.2f} of it off", flush=True)


if __name__ == "__main__":
    parser = draws_parser(__doc__, COUNT)
    parser.add_argument("--log", type=Path)
    parser.add_argument("--bodies", type=int, metavar="N")
    parser.add_argument("--flat", action="store_true", help="the uncertainty of a flat page alone")
    options = parser.parse_args()
    seed = seed_of_today() if options.seed is None else options.seed
    if options.bodies:
        bodies(options.bodies, seed)
    elif options.flat:
        print(f"flat page: {flat_page_noise(seed):.4f} mm rms")
    else:
        main(options.count, seed, options.log)
