"""Two merged views of a book that shadows itself: missing and filled shares, errors of the filled samples.

Then the same through the restoration, and the axis fitted to a board of markers.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.simulated import Flat, Markers, Pose, Spread, Text, Truth
from drivers.simulated.imaging.shot import printed, shoot_scene
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.scene import Axle, Scene, place_sheet
from drivers.simulated.scene.sheets import Sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import FINE, LENSES
from oracles.markers import marker_error
from restore import RangeScan, Settings, restore
from restore.scan import Floats, Mask
from restore.turntable import RotationAxis, fit_axis, merge_views
from restore.turntable.register import register

LENS, DISTANCE_MM, PAGE_MM = LENSES["MIDDLE"], 900.0, (220.0, 180.0)
AXLE = Axle((8.0, -5.0, -915.0), (0.03, 0.05, 1.0))
FAR_MM = 1.0  # off along the normal: twice a sample's spacing, so another surface, or an outlier
OFF_AXIS = np.array([0.3, -0.2, 0.3])  # mm: a careless calibration, for the registration to make good
PERCENTILES = (50, 95, 99)


@dataclass(frozen=True)
class Case:
    """A sheet that shadows itself, and how it lies."""

    sheet: Sheet
    pose: Pose


CASES = {
    "deep book": Case(Spread(slope_deg=68.0, reach_mm=120.0), Pose(turn_deg=90, tilt_deg=14)),
    "gutter": Case(Spread(slope_deg=72.0, reach_mm=40.0), Pose(turn_deg=90, tilt_deg=10)),
}


def main() -> None:
    """Print a line for every case, then the pages, then the axis."""
    print(f"turntable: two views half a turn apart, FINE, MIDDLE lens at {DISTANCE_MM:g} mm, simulated noise")
    headings = ("missing", "shadow", "filled", "ink", "filled", "seen rms", "rms", *(f"p{p}" for p in PERCENTILES))
    row = "{:<12}" + "{:>9}" * (len(headings) + 3)
    print("shares of the page that one view misses, and of that what the other fills: shadow, and ink that drops out;")
    print("mm off the truth along the normal, of what one view saw, and of what filled the shadow")
    print(row.format("sheet", *headings, "residual", "regist.", "s"))
    for name, case in CASES.items():
        scene = _scene(case.sheet, case.pose, Text())
        scans, truths = _views(scene, (0.0, 180.0))
        print(row.format(name, *_merging(scans, truths, _lit(scene))), flush=True)
    _pages()
    _axis()


def _merging(scans: Sequence[RangeScan], truths: Sequence[Truth], lit: Mask) -> list[str]:
    axis = RotationAxis(np.asarray(AXLE.point_mm) + OFF_AXIS, _axis_of(AXLE).direction)
    start = time.perf_counter()
    merged = merge_views(scans, (0.0, 180.0), axis, reference=0)
    seconds = time.perf_counter() - start
    truth, seen = truths[0], scans[0].measured
    page = np.isfinite(truth.flat[..., 0])
    shadow, ink = page & ~seen & ~lit, page & ~seen & lit
    filled = shadow & merged.scan.measured
    distances, distances_seen = (
        _normal_distances(merged.scan, truth, filled),
        _normal_distances(scans[0], truth, page & seen),
    )
    percentiles = [np.percentile(distances, percentile) for percentile in PERCENTILES]
    shares = [(shadow | ink).sum() / page.sum(), shadow.sum() / page.sum(), filled.sum() / shadow.sum()]
    shares += [ink.sum() / page.sum(), (ink & merged.scan.measured).sum() / ink.sum()]
    rms = [_rms(values[values < FAR_MM]) for values in (distances_seen, distances)]
    registration_mm = _registration_error(scans, axis)
    return [
        *(f"{share:.2%}" for share in shares),
        *(f"{value:.4f}" for value in (*rms, *percentiles)),
        f"{merged.views[1].residual_mm:.4f}",
        f"{registration_mm:.3f}",
        f"{seconds:.1f}",
    ]


def _registration_error(scans: Sequence[RangeScan], axis: RotationAxis) -> float:
    """rms mm by which registration puts the samples of the second view beside their true place on the first."""
    spacing = (DISTANCE_MM + LENS.pupil_mm) / LENS.focal_px
    wrong = register(scans[1], scans[0], axis.turn(-180.0), spacing) - _axis_of(AXLE).turn(-180.0)
    points = scans[1].points[scans[1].measured]
    return _rms(np.linalg.norm(points @ wrong[:3, :3].T + wrong[:3, 3], axis=1))


def _pages() -> None:
    row = "{:<12} {:<18}{:>10}{:>10}{:>10}{:>9}"
    print("\nthe page: marker corners against truth")
    print(row.format("sheet", "views", "rms mm", "found", "width", "height"))
    for name, case in CASES.items():
        scans, (truth, _) = _views(_scene(case.sheet, case.pose, Markers()), (0.0, 180.0))
        first = merge_views(scans, (0.0, 180.0), _axis_of(AXLE), reference=0).scan
        chosen = merge_views(scans, (0.0, 180.0), _axis_of(AXLE)).scan
        for views, scan in (("one", scans[0]), ("first, completed", first), ("as chosen", chosen)):
            page = restore(scan, Settings())
            error, (width, height) = marker_error(page.image, page.dpi, truth.markers), page.report["page_mm"]
            found = f"{error.found}/{error.of}"
            print(row.format(name, views, f"{error.rms_mm:.3f}", found, f"{width:.2f}", f"{height:.2f}"), flush=True)


def _axis() -> None:
    print("\naxis from a flat board of markers: degrees and mm off the truth, rms of the corners in mm")
    for turns in ((0.0, 120.0, 240.0), (0.0, 90.0, 180.0, 270.0), (0.0, 20.0, -20.0)):
        scans, _ = _views(_scene(Flat(), Pose(), Markers()), turns)
        fit, true = fit_axis(scans, turns), _axis_of(AXLE)
        distances = fit.axis.point - true.point
        tilt_deg = np.degrees(np.arcsin(np.linalg.norm(np.cross(fit.axis.direction, true.direction))))
        offset_mm = np.linalg.norm(distances - true.direction * (distances @ true.direction))
        print(f"{turns!s:<28} {tilt_deg:.4f}° {offset_mm:.4f} mm, corners {fit.rms_mm:.3f} mm", flush=True)


def _scene(sheet: Sheet, pose: Pose, artwork: Artwork) -> Scene:
    return place_sheet(sheet, printed(artwork, PAGE_MM), depth_mm=DISTANCE_MM + LENS.pupil_mm, pose=pose)


def _views(scene: Scene, turns: Sequence[float]) -> tuple[list[RangeScan], list[Truth]]:
    shots = [
        shoot_scene(scene.turned(turn, AXLE), nominal(LENS), FINE, DISTANCE_MM, np.random.default_rng(index))
        for index, turn in enumerate(turns)
    ]
    return [scan for scan, _ in shots], [truth for _, truth in shots]


def _lit(scene: Scene) -> Mask:
    """(rows, cols) what laser and camera both see in the first view, within the depth window."""
    scan, _ = shoot_scene(scene, nominal(LENS), FINE, DISTANCE_MM, np.random.default_rng(0), noise=False)
    return scan.measured


def _axis_of(axle: Axle) -> RotationAxis:
    return RotationAxis(np.asarray(axle.point_mm), np.asarray(axle.direction) / np.linalg.norm(axle.direction))


def _normal_distances(scan: RangeScan, truth: Truth, where: Mask) -> Floats:
    """(n,) mm by which samples lie off the true surface, along its normal."""
    normal = np.cross(np.gradient(truth.points, axis=0), np.gradient(truth.points, axis=1))
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    distances = np.abs(((scan.points - truth.points) * normal).sum(axis=2)[where])
    return np.asarray(distances[np.isfinite(distances)])


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    main()
