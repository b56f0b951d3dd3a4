"""Pictures of a canned page: the page itself, its layers, tiles of them."""

from __future__ import annotations

import io
from functools import cache

import numpy as np
from PIL import Image, ImageDraw, ImageOps

from drivers.simulated.scene.artwork import Print, Text

TILE, OVERLAP = 256, 1  # px
SHEET_MM, DPI = (160.0, 220.0), 150
PREVIEW_PX = (640, 480)


@cache
def printed_page() -> Print:
    """A printed page, with its words."""
    return Text(title_pt=26.0, sizes_pt=(15.0, 12.0), margin_mm=14.0, seed=2, dpi=DPI).print_on(SHEET_MM)


def layer(sheet: Image.Image, name: str) -> Image.Image:
    """A layer of the page: its light, strain, coverage, uncertainty, the scanner's picture."""
    if name == "original":
        tilted = sheet.rotate(2, expand=True, fillcolor=(24, 24, 24))
        return tilted.resize((640, 640 * tilted.height // tilted.width))
    if name not in ("strain", "coverage", "uncertainty"):
        return sheet.copy()
    y, x = np.mgrid[: sheet.height, : sheet.width]
    field_ = np.sin(x / 180) * np.cos(y / 240)
    red, blue = np.clip(field_, 0, 1), np.clip(-field_, 0, 1)
    strength = (np.hypot(x - 300, y - 400) < 40) * 1.0 if name == "coverage" else np.abs(field_)
    return Image.fromarray((np.dstack([red, 0 * red, blue, strength]) * 255).astype(np.uint8), "RGBA")


def deep_zoom(picture: Image.Image) -> bytes:
    """The description of a picture's pyramid."""
    kind = "png" if picture.mode == "RGBA" else "jpg"
    return (
        f'<?xml version="1.0"?><Image xmlns="http://schemas.microsoft.com/deepzoom/2008" Format="{kind}" '
        f'Overlap="{OVERLAP}" TileSize="{TILE}"><Size Width="{picture.width}" Height="{picture.height}"/></Image>'
    ).encode()


def on_table(sheet: Image.Image) -> Image.Image:
    """A page on a dark table, as a preview sees it."""
    table = Image.new("RGB", PREVIEW_PX, (24, 24, 24))
    page = ImageOps.contain(sheet, (PREVIEW_PX[0] - 40, PREVIEW_PX[1] - 40))
    table.paste(page, ((PREVIEW_PX[0] - page.width) // 2, (PREVIEW_PX[1] - page.height) // 2))
    return table


def warned() -> Image.Image:
    """An overlay of a preview: one place clipped."""
    overlay = Image.new("RGBA", (640, 480))
    ImageDraw.Draw(overlay).ellipse((360, 60, 400, 92), (230, 57, 70, 150))
    return overlay


def encoded(picture: Image.Image, kind: str) -> tuple[bytes, str]:
    """A picture's file and its type."""
    out = io.BytesIO()
    picture.save(out, kind)
    return out.getvalue(), f"image/{kind.lower()}"


def tile(picture: Image.Image, level: int, column: int, line: int) -> tuple[bytes, str] | None:
    """A tile of a picture in Deep Zoom's pyramid, None beside it."""
    top = int(np.ceil(np.log2(max(picture.size))))
    scale = 2.0 ** (level - top)
    size = [max(int(np.ceil(side * scale)), 1) for side in picture.size]
    left, upper = column * TILE - OVERLAP * (column > 0), line * TILE - OVERLAP * (line > 0)
    right, lower = min((column + 1) * TILE + OVERLAP, size[0]), min((line + 1) * TILE + OVERLAP, size[1])
    if left >= right or upper >= lower:
        return None
    part = picture.resize(size).crop((left, upper, right, lower))
    return encoded(part, "PNG" if picture.mode == "RGBA" else "JPEG")
