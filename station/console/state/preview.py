"""A preview with its aids: histogram, clipping, sharpness, and where the depth window is."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from PIL import Image

from drivers.vivid900.geometry.lenses import LENSES, MODES, depth_window
from restore import RangeScan
from restore.scan import Bytes, Floats, Mask
from station.verdict.checks import level_of
from station.verdict.measures import BLACK, WHITE, blur_px
from station.verdict.thresholds import Thresholds

JPEG_QUALITY = 90
# Colours of the overlay, RGB: apart from each other for the colour-blind, too.
COLOURS = {
    "clipped": (230, 57, 70),
    "unmeasured": (120, 120, 130),
    "too_near": (255, 183, 3),
    "too_far": (42, 111, 219),
}
OPACITY = 150


@dataclass(frozen=True, eq=False)
class Preview:
    """Preview.

    facts: JSON values.
    image: JPEG.
    overlay: PNG of the same size, transparent where all is well.
    """

    facts: Mapping[str, Any]
    image: bytes
    overlay: bytes


def look_at(scan: RangeScan, thresholds: Thresholds) -> Preview:
    """The preview of a FAST shot. A scan without colours is shown by its depths."""
    picture = _picture(scan)
    height, width = picture.shape[:2]
    window = window_of(scan.provenance)
    depths = -scan.points[..., 2]
    masks = {
        "clipped": _clipped(picture),
        "unmeasured": _on_picture(~scan.measured, scan, (height, width)),
        "too_near": _on_picture(depths < window[0], scan, (height, width)) if window else None,
        "too_far": _on_picture(depths > window[1], scan, (height, width)) if window else None,
    }
    shown = {name: mask for name, mask in masks.items() if mask is not None}
    facts = {
        "width": width,
        "height": height,
        "mode": scan.provenance.get("mode"),
        "distance_mm": scan.provenance.get("distance_mm"),
        "histogram": _histogram(picture),
        "clipped": {
            "white": float((picture == WHITE).any(axis=2).mean()),
            "black": float((picture == BLACK).all(axis=2).mean()),
        },
        "sharpness": _sharpness(picture, scan, thresholds),
        "depth": _depth(depths[np.isfinite(depths)], window),
        "legend": [
            {"key": name, "colour": "#{:02x}{:02x}{:02x}".format(*COLOURS[name]), "fraction": float(mask.mean())}
            for name, mask in shown.items()
        ],
    }
    return Preview(facts, _jpeg(picture), _overlay(shown, (height, width)))


def window_of(provenance: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return the depths that a capture measures, mm from the lens.

    Of this lens, mode and distance; None when they are unknown.
    """
    lens, mode = LENSES.get(str(provenance.get("lens"))), MODES.get(str(provenance.get("mode")))
    distance = provenance.get("distance_mm")
    if lens is None or mode is None or not isinstance(distance, int | float):
        return None
    near, far = depth_window(lens, mode, float(distance))
    return float(near), float(far)


def _picture(scan: RangeScan) -> Bytes:
    if scan.texture is not None:
        return scan.texture
    depths = -scan.points[..., 2]
    low, high = np.nanmin(depths), np.nanmax(depths)
    grey = np.nan_to_num(255.0 * (high - depths) / max(high - low, 1.0)).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def _clipped(picture: Bytes) -> Mask:
    return np.asarray((picture == WHITE).any(axis=2) | (picture == BLACK).all(axis=2))


def _on_picture(samples: Mask, scan: RangeScan, size: tuple[int, int]) -> Mask:
    """Return the pixels (h, w) of the picture nearest to marked samples.

    samples: (rows, cols).
    """
    mask = np.zeros(size, np.uint8)
    across = size[1] / samples.shape[1]
    x, y = np.rint(scan.texture_xy[samples]).astype(int).T if scan.texture is not None else np.nonzero(samples)[::-1]
    inside = (x >= 0) & (y >= 0) & (x < size[1]) & (y < size[0])
    mask[y[inside], x[inside]] = 1
    side = max(1, int(np.ceil(across)))
    return cv2.dilate(mask, np.ones((side, side), np.uint8)).astype(bool)


def _histogram(picture: Bytes) -> dict[str, list[int]]:
    channels = dict(zip("rgb", np.moveaxis(picture, 2, 0), strict=True))
    channels["grey"] = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    return {name: np.bincount(values.ravel(), minlength=256).tolist() for name, values in channels.items()}


def _sharpness(picture: Bytes, scan: RangeScan, thresholds: Thresholds) -> dict[str, Any]:
    blur = None if scan.texture is None else blur_px(picture, np.ones(picture.shape[:2], bool))
    limits = thresholds.of("blur_px")
    return {"blur_px": blur, "level": "" if blur is None or limits is None else level_of(blur, limits)}


def _depth(depths: Floats, window: tuple[float, float] | None) -> dict[str, Any] | None:
    """Return the depths that were measured, relative to the window.

    depths: (n,) mm.
    """
    if window is None or not depths.size:
        return None
    near, far = window
    inside = float(((depths >= near) & (depths <= far)).mean())
    least, most = float(depths.min()), float(depths.max())
    return {"unit": "mm", "near": near, "far": far, "min": least, "max": most, "inside_fraction": inside}


def _jpeg(picture: Bytes) -> bytes:
    out = io.BytesIO()
    Image.fromarray(picture).save(out, "JPEG", quality=JPEG_QUALITY)
    return out.getvalue()


def _overlay(masks: Mapping[str, Mask], size: tuple[int, int]) -> bytes:
    picture = np.zeros((*size, 4), np.uint8)
    for name in ("unmeasured", "too_near", "too_far", "clipped"):
        if name in masks:
            picture[masks[name]] = (*COLOURS[name], OPACITY)
    out = io.BytesIO()
    Image.fromarray(picture).save(out, "PNG")
    return out.getvalue()
