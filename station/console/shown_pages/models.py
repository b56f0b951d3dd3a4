"""Models for the 3D view, and lengths on the page and on the sheet."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates

from restore import RangeScan
from restore.drawing import rasterise
from restore.scan import Floats
from station.console.faults import ConsoleFault
from station.console.shown_pages.layers import file_of_layer, opened, read_model, scan_of, stored_file
from station.console.shown_pages.strain import end_of_scale
from station.page_files.mesh import unit_square
from station.page_files.model import MM_PER_INCH, centred, encode_arrays
from station.session import Event, Session
from station.session.terms.parts import PAGE

KINDS = ("scan", "mesh", "steps")
PX_PER_MM = 2.0  # of the map by which lengths are measured: finer than the mesh's faces
MAX_MAP_PX = 2**23  # of that map: A0 has four millions, larger pages have fewer pixels to a millimetre
EDGE_PX = 3.0  # beyond the page within which its edge is meant
SAMPLES = 512  # along a line that is measured
SHOWN = 200  # of them that are drawn
MESH = ("vertices", "uv", "faces", "strain", "flat", "page_uv")
STEPS = {"steps.positions": "positions", "steps.step": "step", "steps.faces": "faces", "steps.uv": "uv"}


def scan_model(session: Session, event: Event, *, faces: bool = True) -> bytes:
    """Encode up to 307,200 measured points of a capture, with the scanner's picture."""
    scan = scan_of(session, event)
    facts: dict[str, Any] = {"kind": "scan", **_texture(event.number, scan.texture)}
    if not isinstance(scan, RangeScan):
        arrays = {"vertices": centred(scan.vertices), "faces": scan.faces}
        if scan.texcoords is not None and scan.texture is not None:
            arrays["uv"] = unit_square(scan.texcoords, *scan.texture.shape[:2])
        return encode_arrays(arrays, facts)
    measured = scan.measured
    found = {"vertices": centred(scan.points[measured])}
    if scan.texture is not None:
        found["uv"] = unit_square(scan.texture_xy[measured], *scan.texture.shape[:2])
    return encode_arrays({**found, **({"faces": grid_faces(measured)} if faces else {})}, facts)


def page_model(session: Session, event: Event, leaf: str, capture: int) -> bytes:
    """The fine mesh of a restored page: its surface, its flat positions, its strain.

    leaf: before the names of its layers.
    """
    arrays, _ = read_model(session, event, file_of_layer(f"{leaf}strain"))
    strain = arrays["strain"].astype(np.float64)
    result = event.restored.leaves.get(leaf.removesuffix(".") or PAGE) if event.restored else None
    facts = {"kind": "mesh", "strain_end": end_of_scale(strain), "page_mm": result and result.page_mm}
    wanted = {name: arrays[name] for name in MESH if name in arrays}
    return encode_arrays(wanted, {**facts, **_texture(capture, wanted.get("uv"))})


def steps_model(session: Session, event: Event, leaf: str, capture: int) -> bytes:
    """Encode the recorded steps of the flattening.

    leaf: before the names of its layers. Raises ConsoleFault where the method does not move through space.
    """
    arrays, _ = read_model(session, event, file_of_layer(f"{leaf}strain"))
    if "steps.positions" not in arrays:
        raise ConsoleFault("not_recorded", "this method of flattening has no steps in space", "use the mesh")
    wanted = {name: arrays[stored] for stored, name in STEPS.items() if stored in arrays}
    return encode_arrays(wanted, {"kind": "steps", **_texture(capture, wanted.get("uv"))})


def grid_faces(measured: Any) -> Any:
    """Return triangles (m, 3) between measured neighbours of a grid.

    The indices count the measured samples in reading order.
    measured: (rows, cols) bool.
    """
    index = np.cumsum(measured.ravel()).reshape(measured.shape) - 1
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    whole = [measured[:-1, :-1], measured[:-1, 1:], measured[1:, :-1], measured[1:, 1:]]
    left, right = whole[0] & whole[1] & whole[2], whole[1] & whole[2] & whole[3]
    return np.concatenate(
        [np.stack([a[left], c[left], b[left]], axis=1), np.stack([b[right], c[right], d[right]], axis=1)]
    )


class Ruler:
    """Lengths on one page. Built once for a page; `measure` takes microseconds."""

    def __init__(self, vertices: Floats, places: Floats, faces: Any, size_mm: tuple[float, float]) -> None:
        """The mesh of a page: vertices (n, 3) mm, faces (m, 3).

        places: (n, 2) mm from the upper left corner of its picture, y down.
        size_mm: width and height of the picture.
        """
        area = float(np.prod(np.array(size_mm) + 1.0 / PX_PER_MM))
        self._px_per_mm = min(PX_PER_MM, (MAX_MAP_PX / area) ** 0.5)
        width, height = (max(1, math.ceil(side * self._px_per_mm)) for side in size_mm)
        found = rasterise(places * self._px_per_mm - 0.5, faces, vertices, height, width).astype(np.float64)
        away, nearest = distance_transform_edt(~np.isfinite(found[..., 0]), return_indices=True)
        self._away, self._places = away, found[tuple(nearest)]
        self.size_mm = size_mm

    def measure(self, start: tuple[float, float], end: tuple[float, float]) -> dict[str, Any]:
        """The length between two points of the page, mm from its upper left corner, y down.

        Straight on the page, along the sheet on the same line, and straight through space. Raises ConsoleFault.
        """
        line = np.linspace(start, end, SAMPLES)
        at = (line * self._px_per_mm - 0.5).T[::-1]
        ends = at[:, [0, -1]]
        limits = np.array(self._away.shape)[:, None] - 1
        outside = np.abs(ends - np.clip(ends, 0, limits)).max(axis=0)
        away = map_coordinates(self._away, ends, order=1, mode="nearest")
        if (outside + away > EDGE_PX).any():
            raise ConsoleFault("off_page", "a point lies next to the page", "choose one on it")
        places = np.stack([map_coordinates(self._places[..., k], at, order=1, mode="nearest") for k in range(3)], 1)
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        return {
            "page_mm": float(np.hypot(*(np.subtract(end, start)))),
            "sheet_mm": float(steps.sum()),
            "chord_mm": float(np.linalg.norm(places[-1] - places[0])),
            "points": places[[0, -1]].round(3).tolist(),
            "line": places[np.linspace(0, SAMPLES - 1, SHOWN).astype(int)].round(3).tolist(),
        }


def ruler_of(session: Session, event: Event, leaf: str = "") -> Ruler:
    """The ruler of a restored page.

    leaf: before the names of its layers. Raises ConsoleFault.
    """
    arrays, facts = read_model(session, event, file_of_layer(f"{leaf}strain"))
    with opened(stored_file(session, event, file_of_layer(f"{leaf}page"))) as picture:
        width, height = (side * MM_PER_INCH / facts["dpi"] for side in picture.size)
    u, v = arrays["page_uv"].astype(np.float64).T
    places = np.column_stack([u * width, (1.0 - v) * height])
    return Ruler(arrays["vertices"].astype(np.float64), places, arrays["faces"].astype(np.int64), (width, height))


def _texture(capture: int, texture: Any) -> dict[str, Any]:
    if texture is None:
        return {"texture": None}
    return {"texture": f"/api/pictures/{capture}/original/full"}
