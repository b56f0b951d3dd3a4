"""A page photographed without distortion, and a coarse mesh of it, as a phone has them."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import Text, Wave
from oracles.phones import coarse_mesh
from oracles.simulation.photographs import Shots, photograph_page

PAGE_MM = (200.0, 150.0)
SHOTS = Shots(size=(960, 720), focal_jitter=0.002, radial=(0.0, 0.0, 0.0), tangential=(0.0, 0.0), shadows=False)
SPACING_MM, NOISE_MM = 8.0, 0.3


@pytest.fixture(scope="package")
def taken():
    sheet = Wave(slope_deg=12.0, wavelength_mm=160.0)
    artwork = Text(sizes_pt=(10.0,), seed=2)
    return photograph_page(sheet, artwork, views=5, seed=3, shots=SHOTS, page_mm=PAGE_MM, table="dark")


@pytest.fixture(scope="package")
def mesh(taken):
    return coarse_mesh(taken.scene, SPACING_MM, NOISE_MM, np.random.default_rng(4))
