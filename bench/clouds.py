"""`python -m bench.clouds [--seed S] [--only TABLE …]`: files of other scanners.

sheets   five sheets of a simulated scanner through every layout: error of size, rms error of markers, mirrored or not.
noise    noise of other devices, correlated or not, on the scanner's grid and on one of 2448 × 1836: the same, with the
         95 % interval of the size.
loose    a loose cloud with noise, by this program and by ball pivoting: the same.
damaged  damaged files in one process: outcomes, the longest time, the most memory.
large    2.3 million organised and 2 million loose points with colour to a page of 300 dpi: seconds and memory.
"""

from __future__ import annotations

import argparse
import io
import pickle
import subprocess
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from bench.draws import seed_of_today
from drivers.simulated import Cone, Curl, Miura, MultiFold, Truth, Wave, shoot
from oracles import clouds
from oracles.markers import marker_error
from restore import RangeScan, Settings, SurfaceMesh, load_scan, restore

SHEETS = {"curl": Curl, "wave": Wave, "fold": MultiFold, "cone": Cone, "miura": Miura}
FOCAL_PX, SIZE = 1942.8, "comment width 640\ncomment height 480\n"
depth = partial(clouds.write_depth, focal_px=FOCAL_PX)
ORGANISED: dict[str, tuple[Callable[[Path, RangeScan], None], dict[str, str]]] = {
    "zeros.ply": (partial(clouds.write_ply, missing=0.0, remark=SIZE), {}),
    "metres.ply": (partial(clouds.write_ply, axes=clouds.CAMERA * 1e-3), {"unit": "m"}),
    "left-handed.ply": (partial(clouds.write_ply, axes=np.array([1.0, 1.0, -1.0])), {}),
    "ascii.pcd": (partial(clouds.write_pcd, encoding="ascii"), {}),
    "binary.pcd": (clouds.write_pcd, {}),
    "compressed.pcd": (partial(clouds.write_pcd, encoding="binary_compressed"), {}),
    "a.npz": (clouds.write_npz, {}),
    "a.npy": (clouds.write_npy, {}),
    "a.ptx": (clouds.write_ptx, {}),
    "grid.e57": (clouds.write_e57, {}),
    "gocator.csv": (clouds.write_gocator, {}),
    "open3d": (depth, {}),
    "realsense": (partial(depth, kind="realsense"), {}),
    "ros": (partial(depth, kind="ros"), {"unit": "0.02mm"}),
    "tum": (partial(depth, kind="tum"), {"unit": "0.02mm"}),
    "rays": (partial(depth, kind="float", length=True), {"depth": "ray"}),
}
LOOSE: dict[str, tuple[Callable[[Path, RangeScan], None], dict[str, str]]] = {
    "a.xyz": (clouds.write_text, {}),
    "a.pts": (partial(clouds.write_text, order="x y z i r g b", first="{count}\n"), {}),
    "comma.csv": (partial(clouds.write_text, separator=";", comma=True, first="X;Y;Z;R;G;B\n"), {}),
    "loose.e57": (partial(clouds.write_e57, grid=False), {}),
}
COUNT = 300  # damaged files
READ = """import resource, sys, time
from pathlib import Path
from restore import BadInput, load_scan
for path in sorted(Path(sys.argv[1]).glob("*/*")):
    start = time.process_time()
    try:
        load_scan(path)
        said = "read"
    except BadInput as error:
        said = "refused"
        assert error.hint and path.name in str(error), error
    print(said, time.process_time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, path.name)
"""
PAGE = "import resource, sys, time; from restore import Settings, load_scan, restore\n"
PAGE += "for path in sys.argv[1:]:\n start = time.time(); page = restore(load_scan(path), Settings(dpi=300))\n"
PAGE += "print(page.report['page_mm'], time.time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)"


def main(seed: int, only: tuple[str, ...]) -> None:
    """Print the tables."""
    for table in (sheets, noise, loose, damaged, large):
        if not only or table.__name__ in only:
            print(f"\n{table.__name__}, seed {seed}; mm", flush=True)
            with tempfile.TemporaryDirectory() as folder:
                table(seed, Path(folder))


def sheets(seed: int, folder: Path) -> None:
    """Print a line for each layout of each sheet."""
    for number, (kind, make) in enumerate(SHEETS.items()):
        scan, truth = shoot(make(), seed=seed + number)
        print(f"{kind:<6} {'the scan':<16} {_errors(scan, truth)}", flush=True)
        for name, (write, reading) in (ORGANISED | LOOSE).items():
            write(folder / name, scan)
            print(f"{kind:<6} {name:<16} {_errors(load_scan(folder / name, **reading), truth)}", flush=True)


def noise(seed: int, folder: Path) -> None:
    """Print a line for each noise and grid."""
    scan, truth = shoot(Wave(), seed=seed, noise=False)
    for cols in (640, 2448):
        fine = _finer(scan, cols)
        for sigma_mm in (0.01, 0.1, 0.5):
            for reach in (0.0, 1.5):
                clouds.write_npz(folder / "a.npz", _noisy(fine, sigma_mm, reach, np.random.default_rng(seed)))
                found = _errors(load_scan(folder / "a.npz"), truth, uncertainty=True)
                print(f"{cols:<6} sigma {sigma_mm:<5} over {reach} samples  {found}", flush=True)


def loose(seed: int, folder: Path) -> None:
    """Print two lines for each noise of each sheet."""
    for kind, make in SHEETS.items():
        scan, truth = shoot(make(), seed=seed)
        for sigma_mm in (0.02, 0.1, 0.3):
            noisy = _noisy(scan, sigma_mm, 0.0, np.random.default_rng(seed))
            clouds.write_text(folder / "a.xyz", noisy)
            print(f"{kind:<6} {sigma_mm:<5} view  {_errors(load_scan(folder / 'a.xyz'), truth)}", flush=True)
            print(f"{kind:<6} {sigma_mm:<5} balls {_errors(_pivoted(noisy), truth)}", flush=True)


def damaged(seed: int, folder: Path) -> None:
    """Print outcomes of damaged files, all read by one process.

    That it ends well means that none crashed.
    """
    scan, _ = shoot(Curl(), seed=seed, mode="fast")
    harmed = folder / "harmed"
    for number, (name, data) in enumerate(_damaged(scan, folder, np.random.default_rng(seed))):
        (harmed / f"{number:03}").mkdir(parents=True)
        (harmed / f"{number:03}" / name).write_bytes(data)
    done = subprocess.run([sys.executable, "-c", READ, str(harmed)], capture_output=True, text=True, check=False)
    lines = [line.split() for line in done.stdout.splitlines()]
    slowest = max(lines, key=lambda words: float(words[1]))
    print(f"{len(lines)} files: {dict(Counter(words[0] for words in lines))}, exit code {done.returncode}")
    print(f"longest {slowest[1]} s of processor time: {slowest[3]}; most memory {lines[-1][2]} MB {done.stderr[-300:]}")


def large(seed: int, folder: Path) -> None:
    """Print seconds and memory of large clouds, after a first page of the same process."""
    scan, _ = shoot(Wave(), seed=seed, noise=False)
    small = folder / "small.npz"
    clouds.write_npz(small, _finer(scan, 640))
    clouds.write_npz(folder / "large.npz", _finer(scan, 1760))
    rng = np.random.default_rng(seed)
    u, v = rng.uniform(0, [[280.0], [200.0]], (2, 2_000_000))
    points = np.column_stack([150 * np.sin((u - 140) / 150), v - 100, 900 - 150 * np.cos((u - 140) / 150)])
    np.save(folder / "large.npy", np.column_stack([points, u % 256, v, v]).astype(np.float32))
    for name in ("large.npz", "large.npy"):
        command = [sys.executable, "-c", PAGE, str(small), str(folder / name)]
        print(name, subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip(), flush=True)


def _errors(scan: RangeScan | SurfaceMesh, truth: Truth, *, uncertainty: bool = False) -> str:
    page = restore(scan, Settings(dpi=150, uncertainty=uncertainty))
    error = marker_error(page.image, page.dpi, truth.markers)
    width, height = np.sort(page.report["page_mm"])[::-1] - np.sort(truth.page_mm)[::-1]
    line = f"size {width:+.2f} {height:+.2f}  rms {error.rms_mm:.3f}  markers {error.found} of {error.of}"
    interval = f"  ci95 {page.report['size_mm_ci95']}" if uncertainty else ""
    return f"{line}{'  MIRRORED' if error.mirrored else ''}{interval}  {' '.join(one.code for one in page.findings)}"


def _finer(scan: RangeScan, cols: int) -> RangeScan:
    """Return a scan on a finer grid, its depths and colours interpolated."""
    step = scan.points.shape[1] / cols
    size = cols, round(scan.points.shape[0] / step)
    rays = np.stack(np.meshgrid((np.arange(size[0]) + 0.5) * step - 0.5, (np.arange(size[1]) + 0.5) * step - 0.5), -1)
    x, y = np.moveaxis(rays.astype(np.float32), 2, 0)
    inverse = cv2.remap(-1.0 / scan.points[..., 2], x, y, cv2.INTER_LINEAR, borderValue=np.nan)
    d = 1.0 / inverse
    points = np.dstack([(rays[..., 0] - 319.5) / FOCAL_PX * d, (239.5 - rays[..., 1]) / FOCAL_PX * d, -d])
    assert scan.texture is not None
    return replace(scan, points=points, texture_xy=rays.astype(float), texture=scan.texture)


def _noisy(scan: RangeScan, sigma_mm: float, reach: float, rng: np.random.Generator) -> RangeScan:
    """Return a scan with noise along its rays, correlated over some samples."""
    off = rng.normal(size=scan.points.shape[:2])
    off = cv2.GaussianBlur(off, (0, 0), reach) if reach else off
    return replace(scan, points=scan.points * (1 + sigma_mm * off / off.std() / -scan.points[..., 2])[..., None])


def _pivoted(scan: RangeScan) -> RangeScan | SurfaceMesh:
    """Return the mesh of a cloud by ball pivoting, its colours as its picture."""
    import open3d

    from restore.formats.cleaning.vertex_colours import with_picture

    points, colours = scan.points[scan.measured], clouds.colours_of_samples(scan)[scan.measured]
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(20))
    cloud.orient_normals_towards_camera_location(np.zeros(3))
    near = np.median(cloud.compute_nearest_neighbor_distance())
    radii = open3d.utility.DoubleVector([1.5 * near, 3 * near])
    mesh = open3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, radii)
    return with_picture(SurfaceMesh(points, np.asarray(mesh.triangles, np.int64)), colours)


def _damaged(scan: RangeScan, folder: Path, rng: np.random.Generator) -> Iterator[tuple[str, bytes]]:
    """Yield names and bytes of damaged files: hostile, cut, overwritten.

    With impossible numbers.
    """
    harmful = io.BytesIO()
    np.save(harmful, np.array([{"a": 1}], object), allow_pickle=True)
    yield "pickle.npy", harmful.getvalue()
    yield "pickle.npz", pickle.dumps({"xyz": 1})
    for shape in ((2**13, 2**10, 3), (2**12, 2**11, 3), (2**40, 3)):
        start = io.BytesIO()
        np.lib.format.write_array_header_1_0(start, {"shape": shape, "fortran_order": False, "descr": "<f8"})
        with zipfile.ZipFile(bomb := io.BytesIO(), "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("xyz.npy", start.getvalue() + bytes(2**27))
        yield "bomb.npz", bomb.getvalue()
    yield (
        "bomb.pcd",
        b"FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 8388608\nHEIGHT 1\nDATA binary_compressed\n" + b"\1" * 99,
    )
    yield "huge.ply", b"ply\nformat ascii 1.0\nelement vertex 999999999\nproperty float x\n" + b"comment a\n" * 10**5
    files = {name: write for name, (write, _) in (ORGANISED | LOOSE).items() if "." in name}
    for name, write in files.items():
        write(folder / name, scan)
    sound = {name: (folder / name).read_bytes() for name in files}
    for number in range(COUNT - 7):
        name = list(sound)[number % len(sound)]
        data, kind = bytearray(sound[name]), number // len(sound) % 4
        at = int(rng.integers(len(data) - 8) * rng.random() ** 2)
        if kind == 0:
            data = data[:at]
        elif kind == 1:
            data[at : at + 8] = rng.bytes(8)
        elif kind == 2:
            data[at : at + 8] = np.array([np.nan, 1e30], "<f4").tobytes()
        else:
            digits = [k for k in range(min(len(data), 400)) if chr(data[k]).isdigit()] or [at]
            data[digits[int(rng.integers(len(digits)))]] = ord("9")
        yield name, bytes(data) or b"\0"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=seed_of_today())
    parser.add_argument("--only", nargs="*", default=())
    options = parser.parse_args()
    main(options.seed, tuple(options.only))
