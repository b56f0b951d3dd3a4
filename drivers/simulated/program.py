"""`python -m drivers.simulated.program BOOK FILE`: the volume before a depth camera.

An external program to the driver "program", which writes an organised PLY. The frame is a camera's: x right, y down,
z forward, mm. Every point has a colour, and noise along its line of sight that is correlated over two samples.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from drivers.scanner import ScannerError
from drivers.simulated import config as settings_table
from drivers.simulated.book import presented
from drivers.simulated.imaging.colour import photograph
from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.optics import exact_pitch, trace_rays
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.scene import place_sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import FINE, LENSES
from drivers.vivid900.geometry.triangulation import points_of
from restore.files import read_toml
from restore.scan import Bytes, Floats

HEADER = """ply
format binary_little_endian 1.0
obj_info num_cols {cols}
obj_info num_rows {rows}
element vertex {count}
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
end_header
"""


def picture_opening(table: settings_table.ScannerConfig, opening: int, attempt: int, noise_mm: float) -> bytes:
    """Return the organised PLY of an opening that was captured `attempt` times before.

    noise_mm: standard deviation along the lines of sight.
    """
    shown = presented(table.book, opening, attempt)
    seen, body = shown.scene, nominal(LENSES[table.lens])
    sheet, artwork = seen.build()
    paper = printed(artwork, seen.page_mm)
    depth_mm = table.distance_mm + body.pupil_mm
    scene = place_sheet(
        sheet, paper, depth_mm=depth_mm, pose=seen.pose, table=seen.table, gap_mm=seen.gap_mm, light=seen.light
    )
    rng = np.random.default_rng(table.seed + shown.seed)
    caster, maps = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene)
    pitch = exact_pitch(trace_rays(scene, caster, maps, body, FINE, depth_mm), body, FINE, table.distance_mm)
    points = points_of(pitch, body, FINE, table.distance_mm)
    colours = photograph(scene, caster, maps, body, rng, blur_px=shown.blur_px)
    return encode_organised(noisy(points, noise_mm, rng), colours)


def noisy(points: Floats, noise_mm: float, rng: np.random.Generator) -> Floats:
    """Return points (rows, cols, 3) mm with noise along their lines of sight."""
    noise = gaussian_filter(rng.standard_normal(points.shape[:2]), 1.0)
    away = points / np.linalg.norm(points, axis=2, keepdims=True)
    return np.asarray(points + away * (noise_mm / noise.std() * noise)[..., None])


def encode_organised(points: Floats, colours: Bytes) -> bytes:
    """Return the PLY of points (rows, cols, 3) mm, Y up, and colours (rows, cols, 3)."""
    rows, cols = points.shape[:2]
    table = np.empty(rows * cols, [("xyz", "<f4", 3), ("rgb", "u1", 3)])
    table["xyz"], table["rgb"] = (points * (1.0, -1.0, -1.0)).reshape(-1, 3), colours.reshape(-1, 3)
    return HEADER.format(cols=cols, rows=rows, count=len(table)).encode() + table.tobytes()


def main() -> int:
    """Write the opening's cloud."""
    parser = argparse.ArgumentParser(prog="python -m drivers.simulated.program", description=__doc__)
    parser.add_argument("config", type=Path, help="a station's configuration (TOML) with a book, driver = simulated")
    parser.add_argument("output", type=Path, help="the PLY file to write")
    parser.add_argument("--opening", type=int, default=0)
    parser.add_argument("--attempt", type=int, default=0, help="how often it was captured before")
    parser.add_argument("--noise-mm", type=float, default=0.1)
    arguments = parser.parse_args()
    try:
        print("progress 0.1 projecting", flush=True)
        table = settings_table.read(read_toml(arguments.config).get("scanner", {}))
        content = picture_opening(table, arguments.opening, arguments.attempt, arguments.noise_mm)
        print("progress 0.9 writing", flush=True)
        arguments.output.write_bytes(content)
    except (OSError, ValueError, ScannerError) as error:
        print(f"{arguments.config}: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
