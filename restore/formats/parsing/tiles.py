"""Texture coordinates in other tiles than the picture's own, 0…1.

The picture repeats there. UDIM numbers the tiles from 1001, some exporters negate v, and glTF's sampler repeats the
picture by default.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.mesh.adjacency import components
from restore.mesh.topology import Topology
from restore.scan import Floats, Ints

# Of the picture, in another tile: rounding and the padding round a chart leave it by less.
BORDER = 0.1
MAX_PAST = 1.0  # of the picture: a photograph is cast on a surface that is larger than what it shows


def in_first_tile(path: Path, uv: Floats, faces: Ints) -> Floats:
    """Move every chart of the texture coordinates from its tile to 0…1, by whole numbers.

    A chart is a connected piece of faces. What reaches past the picture itself stays, and shows its border, up to
    MAX_PAST.
    uv: (n, 2).
    faces: (m, 3).
    Raises BadInput for a chart of another tile that reaches past that, and one that reaches farther.
    """
    if _beyond(uv) <= BORDER:
        return uv
    chart = components(Topology(faces).edges, len(uv))
    least, most = np.full((chart.max() + 1, 2), np.inf), np.full((chart.max() + 1, 2), -np.inf)
    np.minimum.at(least, chart, uv)
    np.maximum.at(most, chart, uv)
    tiles = np.floor((least + most) / 2.0)
    moved: Floats = uv - tiles[chart]
    past = np.maximum(-moved, moved - 1.0).max(axis=1) - np.where((tiles == 0.0).all(axis=1), MAX_PAST, BORDER)[chart]
    if past.max() > 0.0:
        worst = chart[np.argmax(past)]
        (u0, v0), (u1, v1) = least[worst], most[worst]
        raise BadInput(
            f"{path}: texture coordinates from ({u0:.3g}, {v0:.3g}) to ({u1:.3g}, {v1:.3g}) on one piece of the "
            "surface repeat its image",
            "lay the texture coordinates out between 0 and 1 in a mesh editor",
        )
    return moved


def _beyond(uv: Floats) -> float:
    """How far the texture coordinates (n, 2) leave 0…1."""
    return float(np.maximum(-uv, uv - 1.0).max(initial=0.0))
