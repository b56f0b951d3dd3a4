"""Sound files of every kind, small: what the bench damages."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from restore import RangeScan, SurfaceMesh, save_scan
from restore.formats import write_abs, write_obj, write_ply, write_vrml, write_vvd
from restore.formats.parsing.mesh import texture_uv
from restore.mesh.triangulate import triangulate
from station.run.small_page import small_page

JOURNAL = {"put": ["page.png"], "removed": ["page.tif"], "before": ["page.png", "page.tif"]}


@cache
def _mesh() -> SurfaceMesh:
    return triangulate(small_page())


def write_scan(path: Path) -> None:
    """Write a scan in the format of its name, as Planish does where it can write it."""
    if path.name.endswith((".abs", ".abs.gz")):
        write_abs(small_page(), path)
    elif path.suffix in (".wrl", ".vvd"):
        {".wrl": write_vrml, ".vvd": write_vvd}[path.suffix](small_page(), path)
    elif path.suffix in (".obj", ".ply"):
        {".obj": write_obj, ".ply": write_ply}[path.suffix](_mesh(), path)
    else:
        write_with_trimesh(path)


def write_with_trimesh(path: Path, **options: Any) -> None:
    """Write the mesh of a scan by trimesh; a binary glTF file with its picture."""
    import trimesh

    mesh = _mesh()
    assert mesh.texture is not None
    assert mesh.texcoords is not None
    picture = None
    if path.suffix == ".glb":
        uv = texture_uv(mesh.texcoords, mesh.texture)
        picture = trimesh.visual.TextureVisuals(uv, image=Image.fromarray(mesh.texture))
    trimesh.Trimesh(mesh.vertices, mesh.faces, visual=picture, process=False).export(path, **options)


def write_folder(path: Path) -> None:
    """Write a scan folder; `path` is a file in it."""
    save_scan(small_page(), path.parent, overwrite=True)


def write_picture(path: Path, *, enlarged: int = 1, **options: Any) -> None:
    """Write the colour image of a scan in the format of its name."""
    texture = small_page().texture
    assert texture is not None
    Image.fromarray(texture.repeat(enlarged, axis=0).repeat(enlarged, axis=1)).save(path, **options)


def write_range_grid(path: Path) -> None:
    """Write a polygon file with a range grid, as the Stanford scanning repository has them."""
    measured = small_page().measured
    rows, cols = measured.shape
    points = small_page().points[measured]
    head = f"ply\nformat ascii 1.0\nobj_info num_cols {cols}\nobj_info num_rows {rows}\nelement vertex {len(points)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element range_grid {rows * cols}\nproperty list uchar int vertex_indices\nend_header\n"
    lines = ["{:.4f} {:.4f} {:.4f}".format(*point) for point in points]
    path.write_text(head + "\n".join(lines + [f"1 {k}" for k in range(len(points))]) + "\n")


def write_point_set(path: Path) -> None:
    """Write the samples of a scan as an ordered point set of Volume Cartographer."""
    points = np.nan_to_num(small_page().points, nan=-1.0)
    rows, cols, _ = points.shape
    header = f"width: {cols}\nheight: {rows}\ndim: 3\nordered: true\ntype: double\nversion: 1\n<>\n"
    path.write_bytes(header.encode() + points.astype("<f8").tobytes())


def write_tifxyz(path: Path) -> None:
    """Write the samples of a scan as a `tifxyz` folder with a mask; `path` is a file in it."""
    points = small_page().points
    for name, axis in zip("xyz", np.moveaxis(np.nan_to_num(np.abs(points), nan=-1.0), 2, 0), strict=True):
        Image.fromarray(axis.astype(np.float32)).save(path.with_name(f"{name}.tif"), compression="tiff_lzw")
    Image.fromarray(np.full(points.shape[:2], 255, np.uint8)).save(path.with_name("mask.tif"))
    path.with_name("meta.json").write_text(json.dumps({"format": "tifxyz", "scale": [0.05, 0.05], "uuid": "a"}))


def write_capture(path: Path) -> None:
    """Write a capture of the bus while the simulated Vivid 900 scans, up to the first images."""
    import usb.core

    from drivers.scsi.usb import UsbBulkOnly
    from drivers.simulated.device.clock import VirtualClock
    from drivers.simulated.device.device import Lens, SimulatedDevice
    from drivers.vivid900.capture.camera import Vivid900
    from drivers.vivid900.connecting import calibrations
    from drivers.vivid900.link import Link
    from drivers.vivid900.profile.profile import SIMULATED, load_profile
    from drivers.vivid900.settings import VividSettings
    from oracles.simulation.buses.capture import TappedBridge, write_capture
    from oracles.simulation.plate import PlateSensor

    clock, profile = VirtualClock(), load_profile(SIMULATED)
    bridge = TappedBridge(SimulatedDevice(Lens("MIDDLE", 1, PlateSensor()), profile, clock))
    transport = UsbBulkOnly(usb.core.find(backend=bridge), target=5)
    with Vivid900(Link(transport, None, clock, clock.sleep), profile, calibrations(None)) as scanner:
        scanner.capture(VividSettings(mode="fast"))
    with path.open("wb") as file:
        write_capture(file, bridge.urbs[:60])  # the images behind are as long as a thousand files


def write_recording(path: Path) -> None:
    """Write a recording of twenty INQUIRY commands."""
    from drivers.scsi.replay import Exchange, Head

    lines = [Head(max_transfer=65536).model_dump_json()]
    for k in range(20):
        exchange = Exchange(cdb=bytes([0x12, 0, 0, 0, 36, k]), asked=36, status=0, data=bytes(range(36)))
        lines.append(exchange.model_dump_json(by_alias=True, exclude_defaults=True))
    path.write_text("\n".join(lines) + "\n")


def write_calibration(path: Path) -> None:
    """Write the calibration of the manual."""
    from drivers.vivid900.geometry.calibration import encode_calibration, nominal
    from drivers.vivid900.geometry.lenses import LENSES

    path.write_text(encode_calibration(nominal(next(iter(LENSES.values())))))


def write_report(path: Path) -> None:
    """Write the report of an earlier run, and its page."""
    (path.parent / "page.png").write_bytes(b"page")
    path.write_text(json.dumps({"files": ["page.png", "page.tif", "page.json"], "page_mm": [120.0, 80.0]}, indent=1))


def write_journal(path: Path) -> None:
    """Write the journal of a run that was killed, with the page that it had replaced."""
    (path.parent / "old").mkdir()
    (path.parent / "old" / "page.png").write_bytes(b"old")
    (path.parent.parent / "page.png").write_bytes(b"new")
    path.write_text(json.dumps(JOURNAL))


def write_coarse(path: Path) -> None:
    """Write a mesh of a few hundred vertices without a picture, so that whole restorations take a second."""
    page = small_page()
    small = RangeScan(page.points[::3, ::3], None, page.texture_xy[::3, ::3])
    write_ply(triangulate(small), path) if path.suffix == ".ply" else write_obj(triangulate(small), path)
