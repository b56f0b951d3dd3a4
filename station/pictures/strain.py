"""Map of the stretch and shear of the flattened page."""

from __future__ import annotations

from collections.abc import Sequence
from math import log10

import cv2
import numpy as np

from restore import FlatMesh, RestoredPage
from restore.drawing import rasterise
from restore.scan import Bytes, Floats
from station.pictures.panels import FAINT_INK, GAP, TITLE_SIZE, blank_picture, draw_text

HEIGHT, WIDTH = 900, 900  # the page fits into this
BAR_WIDTH, LEGEND_WIDTH, LINE = 28, 230, 30
TICKS = 5
LEGEND_HEIGHT = 320  # of the title, three lines of numbers and a scale with room for its ticks
SHOWN = 99.0  # percentile of strain at the end of the scale: a single sliver must not hide the rest
STEPS = (1.0, 2.0, 5.0, 10.0)
FAINT = 0.5  # of its contrast the page keeps under the colours: enough to find one's place
# Compressed – true – stretched: blue to white to red, equally dark at both ends. Shear has one end only.
SIGNED = np.array([[28, 72, 140], [120, 168, 212], [244, 244, 242], [230, 150, 118], [165, 38, 42]], float)
UNSIGNED = np.array([[244, 244, 242], [214, 180, 214], [160, 96, 168], [92, 28, 112]], float)


def strain_picture(page: RestoredPage) -> Bytes:
    """Draw stretch and shear of every face over the page, each with a scale and numbers.

    Returns (h, w, 3) uint8 RGB.
    """
    stretch, shear = page.fine.face_strain.T
    ends = [round_up(float(np.percentile(np.abs(values), SHOWN))) for values in (stretch, shear)]
    maps = (
        _map(page, stretch / ends[0] / 2 + 0.5, "Stretch", SIGNED, (-ends[0], ends[0]), stretch),
        _map(page, shear / ends[1], "Shear", UNSIGNED, (0.0, ends[1]), shear),
    )
    return np.concatenate(maps, axis=0 if maps[0].shape[1] > maps[0].shape[0] else 1)


def round_up(value: float) -> float:
    """Return the next of … 1, 2, 5, 10, 20 … × 10ⁿ, not smaller.

    It is the end of a scale that people can read.
    """
    if value <= 0:
        return 1e-6  # a page without any strain: any scale shows it white
    power = 10.0 ** np.floor(log10(value))
    return float(next(step for step in STEPS if step * power >= value * (1 - 1e-12)) * power)


def _map(
    page: RestoredPage, position: Floats, title: str, colours: Floats, scale: tuple[float, float], values: Floats
) -> Bytes:
    """Draw one quantity over the page.

    position: (m,), position along the colours, 0 to 1.
    values: in numbers, (m,).
    """
    picture = _paint(page.fine, position, colours)
    rows, cols = picture.shape[:2]
    grey = cv2.resize(cv2.cvtColor(page.image, cv2.COLOR_RGB2GRAY), (cols, rows), interpolation=cv2.INTER_AREA)
    picture = (picture * (1.0 - FAINT + FAINT * grey[..., None] / 255.0)).astype(np.uint8)
    sheet = blank_picture(max(rows, LEGEND_HEIGHT) + 2 * GAP, cols + LEGEND_WIDTH + 3 * GAP)
    sheet[GAP : GAP + rows, GAP : GAP + cols] = picture
    lines = (
        f"{len(values)} faces",
        f"rms {np.sqrt(np.mean(values**2)) * 100:.3f} %",
        f"max {np.abs(values).max() * 100:.2f} %",
    )
    return _legend(sheet, cols + 2 * GAP, title, colours, scale, lines)


def _paint(mesh: FlatMesh, position: Floats, colours: Floats) -> Bytes:
    low, high = mesh.flat.min(axis=0), mesh.flat.max(axis=0)
    scale = (np.array([WIDTH, HEIGHT]) / (high - low)).min()
    width, height = np.maximum(1, np.ceil((high - low) * scale)).astype(int)
    xy = np.column_stack([mesh.flat[:, 0] - low[0], high[1] - mesh.flat[:, 1]]) * scale - 0.5
    corners, triangles = xy[mesh.faces.ravel()], np.arange(mesh.faces.size).reshape(-1, 3)
    seen = rasterise(corners, triangles, np.repeat(position, 3)[:, None], height, width)[..., 0]
    covered = np.isfinite(seen)
    picture = blank_picture(height, width)
    picture[covered] = _colour(seen[covered].astype(np.float64), colours)
    return picture


def _colour(position: Floats, colours: Floats) -> Bytes:
    anchors = np.linspace(0, 1, len(colours))
    return np.column_stack([np.interp(position, anchors, channel) for channel in colours.T]).round().astype(np.uint8)


def _legend(
    sheet: Bytes, left: int, title: str, colours: Floats, scale: tuple[float, float], lines: Sequence[str]
) -> Bytes:
    sheet = draw_text(sheet, title, left, GAP, size=TITLE_SIZE)
    for i, line in enumerate(lines):
        sheet = draw_text(sheet, line, left, GAP + 42 + LINE * i)
    top, bottom = GAP + 42 + LINE * (len(lines) + 1), sheet.shape[0] - GAP - LINE
    sheet[top:bottom, left : left + BAR_WIDTH] = _colour(np.linspace(1, 0, bottom - top), colours)[:, None]
    for position in np.linspace(0, 1, TICKS):
        row = round(bottom - position * (bottom - top)) - LINE // 2
        value = 100 * (scale[0] + position * (scale[1] - scale[0]))
        sign = "+" if value > 0 > scale[0] else ""
        sheet = draw_text(sheet, f"{sign}{value:.3g} %", left + BAR_WIDTH + 12, row, ink=FAINT_INK)
    return sheet
