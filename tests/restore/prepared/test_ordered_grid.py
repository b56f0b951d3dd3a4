"""A page over an ordered grid is squared where it is: its middle stays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from restore.flattening.ordered_grid import flatten_grid
from restore.formats.segment import segment_mesh
from restore.prepared.ordered_grid import MAX_GRID_POINTS, unroll_grid
from restore.prepared.prepared import squaring

NODES = 200


def test_both_meshes_turn_about_the_middle_of_the_fine_one():
    x, y = np.meshgrid(np.arange(0.0, 80.0, 4.0), np.arange(0.0, 60.0, 4.0))
    bent = np.stack([50.0 * np.sin(x / 50.0), -y, 50.0 * np.cos(x / 50.0)], axis=-1)
    mesh = segment_mesh(Path("a.vcps"), bent, np.ones(x.shape, bool), None)
    flat = flatten_grid(mesh, NODES, MAX_GRID_POINTS)
    turn, middle = squaring(flat[1])
    found = unroll_grid(mesh, NODES)
    for squared, before in zip((found.coarse, found.fine), flat, strict=True):
        assert (squared.flat - middle) @ turn == pytest.approx(before.flat - middle, abs=1e-9)
