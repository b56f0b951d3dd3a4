"""Files of other scanners, written from a scan by code that readers do not have.

Every writer takes a path and a scan, whose missing samples are NaN, and returns what `load_scan` is to be given.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image

from restore.scan import Bytes, Floats, RangeScan

CAMERA = np.array([1.0, -1.0, -1.0])  # x right, y down, z forward, as cameras have it

Writer = Callable[[Path, RangeScan], dict[str, Any]]


def colours_of_samples(scan: RangeScan) -> Bytes:
    """Return the colour (rows, cols, 3) of each sample."""
    assert scan.texture is not None
    places = np.rint(np.nan_to_num(scan.texture_xy)).astype(int)
    height, width = scan.texture.shape[:2]
    return scan.texture[places[..., 1].clip(0, height - 1), places[..., 0].clip(0, width - 1)]


def write_ply(path: Path, scan: RangeScan, *, axes: Floats = CAMERA, missing: float = np.nan, remark: str = "") -> None:
    """Write vertices in raster order, without faces."""
    points = np.where(np.isfinite(scan.points), scan.points * axes, missing).reshape(-1, 3)
    table = np.zeros(len(points), [(n, "<f4") for n in "xyz"] + [(n, "u1") for n in ("red", "green", "blue")])
    for k, name in enumerate("xyz"):
        table[name] = points[:, k]
    for k, name in enumerate(("red", "green", "blue")):
        table[name] = colours_of_samples(scan)[..., k].ravel()
    properties = "".join(f"property float {n}\n" for n in "xyz")
    properties += "".join(f"property uchar {n}\n" for n in ("red", "green", "blue"))
    header = f"ply\nformat binary_little_endian 1.0\n{remark}element vertex {len(points)}\n{properties}end_header\n"
    path.write_bytes(header.encode() + table.tobytes())


def write_pcd(path: Path, scan: RangeScan, encoding: str = "binary", *, axes: Floats = CAMERA, pose: str = "") -> None:
    """Write an organised cloud in one of the three encodings, its colour packed into a float."""
    rows, cols, _ = scan.points.shape
    points = (scan.points * axes).astype("<f4").reshape(-1, 3)
    red, green, blue = colours_of_samples(scan).reshape(-1, 3).T.astype(np.uint32)
    packed = (red << 16 | green << 8 | blue).view("<f4")
    header = (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\n"
        f"COUNT 1 1 1 1\nWIDTH {cols}\nHEIGHT {rows}\nVIEWPOINT {pose or '0 0 0 1 0 0 0'}\nPOINTS {rows * cols}\n"
        f"DATA {encoding}\n"
    ).encode()
    table = np.column_stack([points, packed])
    if encoding == "ascii":
        lines = (" ".join(f"{number:.9g}" for number in point) for point in table.tolist())
        path.write_bytes(header + "\n".join(lines).encode() + b"\n")
    elif encoding == "binary":
        path.write_bytes(header + table.tobytes())
    else:
        plain = table.T.tobytes()
        compressed = compress(plain)
        path.write_bytes(header + struct.pack("<II", len(compressed), len(plain)) + compressed)


def compress(data: bytes) -> bytes:
    """Compress by LZF: runs of literals, and the last place where the same three bytes stood."""
    out, literals, last, at = bytearray(), bytearray(), {}, 0

    def flush() -> None:
        for first in range(0, len(literals), 32):
            run = literals[first : first + 32]
            out.append(len(run) - 1)
            out.extend(run)
        literals.clear()

    while at < len(data):
        key = data[at : at + 3]
        found = last.get(key)
        last[key] = at
        if found is None or at - found > 8192 or len(key) < 3:
            literals.append(data[at])
            at += 1
            continue
        length = 3
        while length < 264 and at + length < len(data) and data[found + length] == data[at + length]:
            length += 1
        flush()
        back, short = at - found - 1, length - 2
        out.append(min(short, 7) << 5 | back >> 8)
        if short >= 7:
            out.append(short - 7)
        out.append(back & 255)
        at += length
    flush()
    return bytes(out)


def write_npz(path: Path, scan: RangeScan, **more: Any) -> None:
    """Write points and colours with alpha, compressed."""
    rgba = np.dstack([colours_of_samples(scan), np.full(scan.points.shape[:2], 255, np.uint8)])
    np.savez_compressed(path, xyz=(scan.points * CAMERA).astype(np.float32), rgba=rgba, **more)


def write_npy(path: Path, scan: RangeScan) -> None:
    """Write points alone; their picture lies next to the file."""
    np.save(path, scan.points * CAMERA)
    Image.fromarray(colours_of_samples(scan)).save(path.with_suffix(".png"))


def write_ptx(path: Path, scan: RangeScan, *, scans: int = 1) -> None:
    """Write columns from the left, each from the bottom up, in metres, z up, looking along y."""
    rows, cols, _ = scan.points.shape
    points = np.nan_to_num(scan.points[..., [0, 2, 1]] * [1.0, -1.0, 1.0]) * 1e-3
    colours = colours_of_samples(scan)
    lines = [f"{cols}", f"{rows}", "0 0 0", "1 0 0", "0 1 0", "0 0 1", "1 0 0 0", "0 1 0 0", "0 0 1 0", "0 0 0 1"]
    for col in range(cols):
        for row in range(rows - 1, -1, -1):
            x, y, z = points[row, col]
            r, g, b = colours[row, col]
            lines.append(f"{x:.7f} {y:.7f} {z:.7f} 0.5 {r} {g} {b}" if x or y or z else "0 0 0 0.5 0 0 0")
    path.write_text("\n".join(lines * scans) + "\n")


def write_gocator(path: Path, scan: RangeScan) -> None:
    """Write a SurfacePointCloud section.

    Tuples row by row; height is towards the sensor, and y runs down.
    """
    rows, cols, _ = scan.points.shape
    middle = np.nanmedian(scan.points[..., 2])
    points = (scan.points - [0.0, 0.0, middle]) * [1.0, -1.0, 1.0]
    body = (
        ",".join("" if np.isnan(number) else f"{number:.4f}" for number in line) for line in points.reshape(rows, -1)
    )
    names = ",".join(f"{name}{k}" for k in range(cols) for name in "xyz")
    info = "Info\nCSV Version,Sensor Count,Trigger Mode\n2,1,0\nEnd\n"
    facts = f"Frame,Source,Row Count,Column Count,X Offset,Y Offset,Z Offset\n1,0,{rows},{cols},0,0,0\n"
    path.write_text(f"{info}SurfacePointCloud\n{facts}{names}\n" + "\n".join(body) + "\nEnd\n")


def write_e57(path: Path, scan: RangeScan, *, grid: bool = True) -> None:
    """Write one scan in metres, with the row and the column of each point where it has a grid."""
    import pye57

    measured = scan.measured
    points, colours = (scan.points * CAMERA)[measured] * 1e-3, colours_of_samples(scan)[measured]
    data = {f"cartesian{name}": points[:, k].copy() for k, name in enumerate("XYZ")}
    data |= {f"color{name}": colours[:, k].copy() for k, name in enumerate(("Red", "Green", "Blue"))}
    if grid:
        rows, cols = np.nonzero(measured)
        data |= {"rowIndex": rows.astype(np.int32), "columnIndex": cols.astype(np.int32)}
    with pye57.E57(str(path), mode="w") as file:
        file.write_scan_raw(data, rotation=np.array([1.0, 0, 0, 0]), translation=np.zeros(3))


def write_text(
    path: Path,
    scan: RangeScan,
    *,
    order: str = "x y z r g b",
    separator: str = " ",
    comma: bool = False,
    first: str = "",
) -> None:
    """Write the measured points as lines of text: a first line, an order of columns.

    A separator, decimal commas.
    """
    measured = scan.measured
    columns: Mapping[str, Floats] = {
        **dict(zip("xyz", (scan.points * CAMERA)[measured].T, strict=True)),
        **dict(zip("rgb", colours_of_samples(scan)[measured].T, strict=True)),
        "i": colours_of_samples(scan)[measured].mean(axis=1),
    }
    table = [[f"{v:.4f}" if n in "xyz" else f"{v:.0f}" for v in columns[n]] for n in order.split()]
    lines = [separator.join(point) for point in zip(*table, strict=True)]
    text = "\n".join(lines).replace(".", "," if comma else ".")
    path.write_text(first.replace("{count}", str(len(lines))) + text + "\n")


def write_depth(
    folder: Path, scan: RangeScan, focal_px: float, *, kind: str = "open3d", step_mm: float = 0.02, length: bool = False
) -> None:
    """Write a folder of a depth image, a colour image and intrinsics of one program.

    focal_px: in samples; the axis goes through the middle of the grid. length: of the ray instead of the depth.
    """
    folder.mkdir(exist_ok=True)
    rows, cols, _ = scan.points.shape
    depth = np.linalg.norm(scan.points, axis=2) if length else -scan.points[..., 2]
    cx, cy = (float(value) for value in _middle(scan, focal_px))
    if kind == "float":
        Image.fromarray(np.nan_to_num(depth * 1e-3).astype(np.float32)).save(folder / "depth.tiff")
    else:
        cv2.imwrite(str(folder / "depth.png"), np.rint(np.nan_to_num(depth) / step_mm).astype(np.uint16))
    Image.fromarray(colours_of_samples(scan)).save(folder / "color.png")
    size = {"width": cols, "height": rows}
    if kind == "open3d":
        matrix = [focal_px, 0, 0, 0, focal_px, 0, cx, cy, 1]
        _write(folder / "intrinsic.json", {**size, "intrinsic_matrix": matrix, "depth_scale": 1000.0 / step_mm})
    elif kind == "realsense":
        camera = {**size, "ppx": cx, "ppy": cy, "fx": focal_px, "fy": focal_px}
        model = {"model": "distortion.inverse_brown_conrady", "coeffs": [0.0] * 5, "depth_scale": step_mm * 1e-3}
        _write(folder / "intrinsics.json", camera | model)
    elif kind == "ros":
        numbers = f"[{focal_px}, 0.0, {cx}, 0.0, {focal_px}, {cy}, 0.0, 0.0, 1.0]"
        text = f"image_width: {cols}\nimage_height: {rows}\ncamera_name: d\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
        text += f"  data: {numbers}\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
        (folder / "camera_info.yaml").write_text(text + "  data: [0.0, 0.0, 0.0, 0.0, 0.0]\n")
    elif kind == "tum":
        (folder / "intrinsics.txt").write_text(f"{focal_px} {focal_px} {cx} {cy}\n")
    else:
        _write(folder / "intrinsics.json", {**size, "fx": focal_px, "fy": focal_px, "cx": cx, "cy": cy})


def _middle(scan: RangeScan, focal_px: float) -> tuple[float, float]:
    """Return the column and the row of the axis."""
    row, col = (axis[0] for axis in np.nonzero(scan.measured))
    x, y, z = scan.points[row, col]
    return col - focal_px * x / -z, row + focal_px * y / -z


def _write(path: Path, facts: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(facts))
