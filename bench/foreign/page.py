"""A curled page of known flat size with an asymmetric print: what every family of the bench writes in its own way."""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from restore.scan import Bytes, Floats, Ints

PIXELS_PER_MM = 5.0
WORDS = ("quick brown fox", "lazy dog", "old book", "by the window", "while rain falls", "and reads", "over")
STEEPEST = 0.9  # rad, of the curl beside the spine
CURL_MM = 35.0  # from the spine over which it decays


@dataclass
class Part:
    """Some faces (m, 3) of vertices (n, 3) mm, uv (n, 2) with v up, and the name of their picture."""

    vertices: Floats
    uv: Floats
    faces: Ints
    picture: str = "page"


@dataclass
class Case:
    """A page as a family drew it.

    parts, pictures  what is written; flat_mm  width and height; shown  the picture of the flat page (h, w, 3).
    mirrored         whether the texture map is mirrored to the faces, which a finding has to say.
    """

    parts: list[Part]
    pictures: dict[str, Bytes]
    flat_mm: tuple[float, float]
    shown: Bytes
    mirrored: bool = False
    notes: dict[str, Any] = field(default_factory=dict)


def draw_page(rng: Random, *, columns: int | None = None, bow: float | None = None) -> Case:
    """A page of drawn size, curl and number of columns, in one part with one picture."""
    width, height = rng.uniform(120.0, 220.0), rng.uniform(80.0, 140.0)
    columns = columns or rng.randint(30, 90)
    rows = max(8, round(columns * height / width))
    bow = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 1.0) if bow is None else bow
    picture = print_page(rng, width, height)
    vertices, uv, faces = sheet(columns, rows, width, height, bow)
    return Case([Part(vertices, uv, faces)], {"page": picture}, (width, height), picture)


def print_page(rng: Random, width: float, height: float) -> Bytes:
    """(h, w, 3) a frame, lines of words, a red disc at the top right, a blue square at the bottom left."""
    w, h = round(width * PIXELS_PER_MM), round(height * PIXELS_PER_MM)
    image = Image.new("RGB", (w, h), (244, 240, 230))
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(22)
    draw.rectangle([8, 8, w - 9, h - 9], outline=(30, 30, 30), width=3)
    draw.text((40, 30), "PAGE top left", fill=(10, 10, 10), font=ImageFont.load_default(34))
    draw.ellipse([w - 110, 30, w - 40, 100], fill=(200, 30, 30))
    draw.rectangle([40, h - 110, 110, h - 40], fill=(30, 60, 200))
    draw.polygon([(w - 110, h - 40), (w - 40, h - 40), (w - 75, h - 110)], fill=(20, 140, 40))
    for y in range(130, h - 140, 34):
        line = ""
        while draw.textlength(line) < w / 2.4:
            line += rng.choice(WORDS) + " "
        draw.text((70, y), line, fill=(20, 20, 20), font=font)
    return np.asarray(image)


def sheet(columns: int, rows: int, width: float, height: float, bow: float) -> tuple[Floats, Floats, Ints]:
    """Vertices (n, 3) mm of a page curled along arc length, uv (n, 2) with v up, faces (m, 3) seen from above."""
    fine = np.linspace(0.0, width, 6001)
    slope = bow * (STEEPEST * np.exp(-fine / CURL_MM) - 0.1 * np.sin(2 * np.pi * fine / width))
    middle, step = (slope[1:] + slope[:-1]) / 2, np.diff(fine)
    along, up = (np.r_[0.0, np.cumsum(part * step)] for part in (np.cos(middle), np.sin(middle)))
    s, t = np.meshgrid(np.linspace(0.0, width, columns), np.linspace(0.0, height, rows))
    vertices = np.stack([np.interp(s, fine, along), t, np.interp(s, fine, up)], -1).reshape(-1, 3)
    uv = np.stack([s / width, t / height], -1).reshape(-1, 2)
    return vertices, uv, grid_triangles(np.arange(rows * columns).reshape(rows, columns))


def grid_triangles(number: Ints) -> Ints:
    """(m, 3) triangles of a grid of vertex numbers whose rows run up."""
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    return np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
