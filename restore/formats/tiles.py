"""Texture coordinates in other tiles of the plane than the picture's own, 0…1: the picture repeats there.

UDIM numbers the tiles from 1001, some exporters negate v, and glTF's sampler repeats the picture by default.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.mesh.adjacency import components
from restore.mesh.network import edges_of
from restore.scan import Floats, Ints

# Of the picture: rounding and the padding round a chart leave 0…1 by less, a picture that repeats shows more of itself.
BORDER = 0.1


def in_first_tile(path: Path, uv: Floats, faces: Ints) -> Floats:
    """The texture coordinates (n, 2), every chart of faces (m, 3) moved by whole numbers from its tile to 0…1.

    A chart is a connected piece; coordinates up to BORDER outside of 0…1 stay. Raises BadInput for a chart that reaches
    into another tile.
    """
    if _beyond(uv) <= BORDER:
        return uv
    chart = components(edges_of(faces), len(uv))
    least, most = np.full((chart.max() + 1, 2), np.inf), np.full((chart.max() + 1, 2), -np.inf)
    np.minimum.at(least, chart, uv)
    np.maximum.at(most, chart, uv)
    moved: Floats = uv - np.floor((least + most) / 2.0)[chart]
    if _beyond(moved) > BORDER:
        worst = chart[np.argmax(np.maximum(-moved, moved - 1.0).max(axis=1))]
        (u0, v0), (u1, v1) = least[worst], most[worst]
        raise BadInput(
            f"{path}: texture coordinates from ({u0:.3g}, {v0:.3g}) to ({u1:.3g}, {v1:.3g}) on one piece of the "
            "surface repeat its picture",
            "lay the texture coordinates out between 0 and 1 in a mesh editor",
        )
    return moved


def _beyond(uv: Floats) -> float:
    """How far the texture coordinates (n, 2) leave 0…1."""
    return float(np.maximum(-uv, uv - 1.0).max(initial=0.0))
