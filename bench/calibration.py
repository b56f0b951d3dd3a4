"""`python -m bench.calibration`: a body whose geometry is unknown to the driver, calibrated from scans of a board.

Every scan goes the whole way: command bytes, sums of the CCD, driver, scan folder, `planish calibrate`.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from drivers import open_scanner
from drivers.simulated import Binding, Markers, shoot
from drivers.vivid900.geometry.calibration import Calibration, encode_calibration, read_calibration
from drivers.vivid900.geometry.lenses import FINE
from drivers.vivid900.geometry.triangulation import points_of
from drivers.vivid900.settings import VividSettings
from oracles.hidden_body import HIDDEN_BODY, NOMINAL
from oracles.markers import marker_error
from restore import Settings, restore
from restore.formats import save_scan
from station.cli import main as planish

TILTS = ((0.0, 0.0), (25.0, 90.0), (-25.0, 0.0), (20.0, 45.0))
POSES = [(distance, *tilt) for distance in (700.0, 900.0, 1150.0) for tilt in TILTS]
TIMES = 50


def scan_boards(folder: Path) -> list[str]:
    """Scan the board in all poses; returns the arguments for `planish calibrate`."""
    body = folder / "body.toml"
    body.write_text(encode_calibration(HIDDEN_BODY), "utf-8")
    named = []
    for k, (distance, tilt, turn) in enumerate(POSES):
        scene = {"sheet": "flat", "artwork": "markers", "pose": {"tilt_deg": tilt, "turn_deg": turn}}
        table: dict[str, Any] = {"driver": "simulated", "body": str(body), "distance_mm": distance, "seed": k}
        with open_scanner({**table, "scene": scene}) as scanner:
            scan = scanner.capture(VividSettings(distance_mm=distance))
        save_scan(scan, folder / f"{k}.scan")
        named.append(f"{folder / f'{k}.scan'}" + (f"@{distance}" if tilt == 0 else ""))
    return named


def field_errors(calibrated: Calibration) -> dict[float, tuple[float, float]]:
    """Distance → rms and largest error, mm, of points over the whole field and window."""
    errors = {}
    for distance in (600.0, 900.0, 1200.0):
        offsets = []
        for lines in (-40.0, 0.0, 40.0):
            pitch = np.arange(480.0)[:, None] + 62 + lines + np.zeros((1, 640))
            offsets.append(points_of(pitch, calibrated, FINE, distance) - points_of(pitch, HIDDEN_BODY, FINE, distance))
        length = np.linalg.norm(offsets, axis=-1)
        errors[distance] = float(np.sqrt((length**2).mean())), float(length.max())
    return errors


def shape_error(calibrated: Calibration) -> float:
    """Largest error, mm, of the shape of a scene that fills field and window at 900 mm: after the best rigid motion."""
    lines = np.linspace(-40, 40, 480 * 640).reshape(480, 640, order="F")
    pitch = np.arange(480.0)[:, None] + 62 + lines
    here, there = (points_of(pitch, body, FINE, 900.0)[::16, ::16].reshape(-1, 3) for body in (HIDDEN_BODY, calibrated))
    here, there = here - here.mean(axis=0), there - there.mean(axis=0)
    turn, _ = Rotation.align_vectors(here, there)
    return float(np.linalg.norm(turn.apply(there) - here, axis=1).max())


def page_error(calibration: Calibration) -> float:
    """rms error, mm, of a page that curls from its binding, scanned by the hidden body and read by a calibration."""
    scan, truth = shoot(Binding(), Markers(), seed=1, body=HIDDEN_BODY, calibration=calibration)
    page = restore(scan, Settings())
    return marker_error(page.image, page.dpi, truth.markers).rms_mm


def triangulation_ms() -> tuple[float, float]:
    """Best wall-clock and processor time, ms, for the 307,200 samples of a FINE shot."""
    pitch = np.arange(480.0)[:, None] + 62 + np.zeros((1, 640))
    points_of(pitch, HIDDEN_BODY, FINE, 900.0)
    wall, busy = [], []
    for _ in range(TIMES):
        start, work = perf_counter(), process_time()
        points_of(pitch, HIDDEN_BODY, FINE, 900.0)
        wall.append(perf_counter() - start)
        busy.append(process_time() - work)
    return min(wall) * 1e3, min(busy) * 1e3


def main() -> None:
    """Print what the calibration recovers and what it is good for."""
    wall, busy = triangulation_ms()
    print(f"\ntriangulation of 307,200 samples: {wall:.1f} ms (processor {busy:.1f} ms)")
    with TemporaryDirectory() as name:
        folder = Path(name)
        shots, output = scan_boards(folder), folder / "found.toml"
        start = perf_counter()
        if planish(["calibrate", *shots, "-o", str(output)]):
            raise RuntimeError("the calibration failed")
        print(f"calibrated from {len(shots)} scans in {perf_counter() - start:.1f} s")
        calibrated = read_calibration(output)
    for name, true in HIDDEN_BODY.as_json().items():
        print(f"  {name:12} true {true}  found {getattr(calibrated, name)}  manual {getattr(NOMINAL, name)}")
    print("error over field and window, mm (rms, largest)")
    for label, calibration in (("manual", NOMINAL), ("calibrated", calibrated)):
        cells = "  ".join(f"{d:.0f} mm: {rms:.3f} {most:.3f}" for d, (rms, most) in field_errors(calibration).items())
        print(f"  {label:10}  {cells}  shape at 900 mm: {shape_error(calibration):.3f}")
    print("restored marker page, rms mm")
    for label, calibration in (("manual", NOMINAL), ("calibrated", calibrated), ("true", HIDDEN_BODY)):
        print(f"  {label:10}  {page_error(calibration):.3f}")


if __name__ == "__main__":
    main()
