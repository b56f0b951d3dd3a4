"""Families of pages: what a program did to the mesh before it was written."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

import numpy as np

from bench.foreign.page import Case, Part, draw_page, grid_triangles
from restore.scan import Floats, Ints

JITTERS = (0.0, 1e-5, 1e-4, 1e-3, 1e-2, 0.03, 0.1, 0.3, 1.0)  # of the mean edge


def tiles(rng: Random) -> Case:
    """Parts whose seams differ by a jitter, from none to a mean edge."""
    case, across, down = draw_page(rng), rng.randint(1, 4), rng.randint(1, 3)
    whole = case.parts[0]
    centres = whole.uv[whole.faces].mean(axis=1)
    tile = np.floor(centres * [across, down]).astype(int) @ [1, across]
    parts = [_jittered(rng, _chosen(whole, tile == k), whole) for k in range(across * down)]
    case.parts = parts if rng.random() < 0.5 else [_together(parts)]
    return case


def soup(rng: Random) -> Case:
    """Every triangle with corners of its own, that a jitter sets apart."""
    case = draw_page(rng)
    whole = case.parts[0]
    loose = Part(
        whole.vertices[whole.faces].reshape(-1, 3),
        whole.uv[whole.faces].reshape(-1, 2),
        np.arange(whole.faces.size).reshape(-1, 3),
    )
    case.parts = [_jittered(rng, loose, whole)]
    return case


def orientation(rng: Random) -> Case:
    """One chart or an atlas of six, its map as it should be, v downwards, or mirrored; bowed to either side."""
    case, kind = draw_page(rng), rng.choice(["right", "right", "v down", "u back"])
    if rng.random() < 0.5:
        case.parts, case.pictures = _atlas(case, rng)
    for part in case.parts:
        if kind == "v down":
            part.uv = part.uv * [1.0, -1.0] + [0.0, 1.0]
        elif kind == "u back":
            part.uv = part.uv * [-1.0, 1.0] + [1.0, 0.0]
    case.mirrored = kind != "right"
    return case


def fins(rng: Random) -> Case:
    """Strips that stand on inner rows of the page, and a page of a book beside it."""
    case = draw_page(rng)
    whole = case.parts[0]
    rows = len(np.unique(whole.uv[:, 1]))
    columns = len(whole.uv) // rows
    number = np.arange(rows * columns).reshape(rows, columns)
    for _ in range(rng.randint(1, 3)):
        row, start = rng.randrange(2, rows - 2), rng.randrange(0, columns // 2)
        foot = number[row, start : start + rng.randint(4, columns // 2)]
        _stand(whole, foot, rng.uniform(2.0, 15.0))
    return case


def _stand(whole: Part, foot: Ints, height: float) -> None:
    """Add a strip of a height, mm, that stands on a row of vertices (k,)."""
    top = len(whole.vertices) + np.arange(len(foot))
    whole.vertices = np.vstack([whole.vertices, whole.vertices[foot] + [0.0, 0.0, height]])
    whole.uv = np.vstack([whole.uv, whole.uv[foot] + [0.0, 0.01]])
    quads = np.stack([foot[:-1], foot[1:], top[1:], top[:-1]], axis=1)
    whole.faces = np.concatenate([whole.faces, quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _chosen(whole: Part, member: Floats) -> Part:
    faces = whole.faces[member]
    used = np.unique(faces)
    number = np.zeros(len(whole.vertices), np.int64)
    number[used] = np.arange(len(used))
    return Part(whole.vertices[used].copy(), whole.uv[used].copy(), number[faces])


def _jittered(rng: Random, part: Part, whole: Part) -> Part:
    """A part whose vertices are moved by the jitter that the seed gives to the whole page."""
    corners = whole.vertices[whole.faces]
    edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
    jitter = Random(len(whole.faces)).choice(JITTERS) * edge
    noise = np.random.default_rng(rng.randrange(2**32)).normal(0.0, 1.0, part.vertices.shape)
    return Part(part.vertices + jitter * noise, part.uv, part.faces, part.picture)


def _together(parts: list[Part]) -> Part:
    firsts = np.cumsum([0] + [len(part.vertices) for part in parts])[:-1]
    return Part(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.uv for part in parts]),
        np.concatenate([part.faces + first for part, first in zip(parts, firsts, strict=True)]),
    )


def _atlas(case: Case, rng: Random) -> tuple[list[Part], dict[str, np.ndarray]]:
    """The page in 3 × 2 charts, shuffled over a picture of its own with a margin round each."""
    whole, picture = case.parts[0], case.pictures["page"]
    height, width = picture.shape[:2]
    across, down, margin = 3, 2, 6
    w, h = width // across, height // down
    sheet = np.full((down * (h + 2 * margin), across * (w + 2 * margin), 3), 90, np.uint8)
    tile = np.floor(whole.uv[whole.faces].mean(axis=1) * [across, down]).astype(int) @ [1, across]
    places = rng.sample(range(across * down), across * down)
    parts = []
    for k, place in enumerate(places):
        part = _chosen(whole, tile == k)
        pixels = part.uv * [width, -height] + [0.0, height]  # y down
        low, high = np.floor(pixels.min(axis=0)).astype(int), np.ceil(pixels.max(axis=0)).astype(int)
        x, y = (place % across) * (w + 2 * margin) + margin, (place // across) * (h + 2 * margin) + margin
        piece = picture[low[1] : high[1], low[0] : high[0]]
        room = sheet[y : y + piece.shape[0], x : x + piece.shape[1]]
        room[:] = piece[: room.shape[0], : room.shape[1]]
        moved = pixels - low + [x, y]
        part.uv = np.column_stack([moved[:, 0] / sheet.shape[1], 1.0 - moved[:, 1] / sheet.shape[0]])
        parts.append(part)
    return [_together(parts)], {"page": sheet}


def book(rng: Random) -> Case:
    """A strip of the page below beyond the right edge of the page, which a single row of faces joins to it."""
    case = draw_page(rng, columns=rng.randint(40, 90))
    whole = case.parts[0]
    number = np.arange(len(whole.uv)).reshape(len(np.unique(whole.uv[:, 1])), -1)
    edge, inner = whole.vertices[number[:, -1]], whole.vertices[number[:, -2]]
    out = (edge - inner) / np.linalg.norm(edge - inner, axis=1)[:, None]
    down = np.cross(out, [0.0, 1.0, 0.0])
    down *= -np.sign(down[:, 2:])  # the page is seen from above
    step, reach = rng.uniform(1.5, 6.0), np.linspace(0.0, rng.uniform(3.0, 8.0), 4)
    strip = edge[:, None] + step * down[:, None] + reach[None, :, None] * out[:, None]
    numbers = len(whole.uv) + np.arange(strip.size // 3).reshape(strip.shape[:2])
    uv = np.repeat(whole.uv[number[:, -1]], len(reach), axis=0) - [0.02, 0.0]
    case.parts = [
        Part(
            np.vstack([whole.vertices, strip.reshape(-1, 3)]),
            np.vstack([whole.uv, uv]),
            np.concatenate([whole.faces, grid_triangles(np.hstack([number[:, -1:], numbers]))]),
        )
    ]
    return case


def doubled(rng: Random) -> Case:
    """A segment of a CT volume with some of its rows or columns twice, in place of the next or besides it."""
    case = draw_page(rng, columns=rng.randint(60, 120))
    case.notes = {
        "writer": "tifxyz",
        "lines": rng.randint(1, 3),
        "axis": rng.randrange(2),
        "besides": rng.random() < 0.5,
    }
    return case


def dialect(rng: Random) -> Case:
    """A page in a file as another program spells it."""
    case = draw_page(rng)
    case.notes = {"dialect": True}
    return case


FAMILIES: dict[str, Callable[[Random], Case]] = {
    "tiles": tiles,
    "soup": soup,
    "orientation": orientation,
    "fins": fins,
    "book": book,
    "doubled lines": doubled,
    "dialects": dialect,
}
