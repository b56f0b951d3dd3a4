"""Eight frames of the flattening, as in Fig. 5 of the paper (TPAMI 2008)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from restore import FlatMesh, SurfaceMesh
from restore.scan import Bytes, Floats, Ints
from station.pictures.panels import FAINT_INK, blank_picture, draw_text
from station.pictures.view import oblique_camera, render_mesh

FRAMES = 8
COLUMNS = 4
KEPT = 32  # frames kept on the way, out of which the eight are chosen: memory stays bounded however long it takes
HEIGHT, WIDTH = 420, 520  # pixels of a frame


class Frame(NamedTuple):
    """Sheet after a step.

    positions: (n, 3) mm, z away from the table.
    faces: (m, 3).
    """

    step: int
    positions: Floats
    faces: Ints


class Recorder:
    """Callback of the flattening that keeps evenly spaced steps and the last, bounded."""

    def __init__(self) -> None:
        self._kept: list[Frame] = []
        self._stride = 1
        self._calls = 0
        self._last: Frame | None = None

    def __call__(self, step: int, positions: Floats, faces: Ints) -> None:
        self._last = Frame(step, positions.copy(), faces)  # the solver goes on in the same array
        if self._calls % self._stride == 0:
            self._kept.append(self._last)
        self._calls += 1
        if len(self._kept) > KEPT:
            self._kept = self._kept[::2]
            self._stride *= 2

    def frames(self, count: int = FRAMES) -> list[Frame]:
        """Return up to `count` frames in order, with equal movement between.

        The first and the last step are among them.
        """
        if self._last is None:
            return []
        kept = self._kept if self._kept[-1] is self._last else [*self._kept, self._last]
        moved = np.cumsum([0.0] + [_movement(a, b) for a, b in pairwise(kept)])
        if len(kept) <= count:
            return kept
        if moved[-1] == 0:
            return [kept[0], kept[-1]]
        wanted, place = np.searchsorted(moved, np.linspace(0, moved[-1], count) - 1e-9), np.arange(count)
        wanted = np.maximum.accumulate(wanted - place) + place  # where much moved at once, the steps round it
        wanted = np.minimum(wanted, len(kept) - count + place)
        wanted[-1] = len(kept) - 1
        return [kept[i] for i in wanted]


def frames_sheet(frames: Sequence[Frame], mesh: FlatMesh) -> Bytes:
    """The frames, painted, all through the same camera: (h, w, 3) uint8 RGB."""
    everything = np.concatenate([frame.positions for frame in frames])
    camera = oblique_camera(everything)
    sheet = blank_picture(HEIGHT * -(-len(frames) // COLUMNS), WIDTH * COLUMNS)
    for i, frame in enumerate(frames):
        top, left = HEIGHT * (i // COLUMNS), WIDTH * (i % COLUMNS)
        picture = render_mesh(_painted(frame, mesh), camera, height=HEIGHT, width=WIDTH, extent=everything)
        picture = draw_text(picture, f"step {frame.step}", 16, HEIGHT - 36, ink=FAINT_INK)
        sheet[top : top + HEIGHT, left : left + WIDTH] = picture
    return sheet


def _painted(frame: Frame, mesh: FlatMesh) -> SurfaceMesh:
    bare = SurfaceMesh(frame.positions, frame.faces)
    if len(frame.positions) != len(mesh.vertices):  # a method that works on points of its own
        return bare
    return replace(bare, texcoords=mesh.texcoords, texture=mesh.texture)


def _movement(before: Frame, after: Frame) -> float:
    if before.positions.shape != after.positions.shape:
        return 0.0
    return float(np.linalg.norm(after.positions - before.positions, axis=1).mean())
