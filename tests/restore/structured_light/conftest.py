"""A small simulated rig over a waving page of print, and its captures."""

from __future__ import annotations

import pytest

from drivers.simulated import Text, Wave
from oracles.simulation.projector import RigPlan, build_rig
from oracles.structured_light import captured

PLAN = RigPlan(size=(640, 480), projector=(512, 320), distance_mm=500.0, baseline_mm=180.0, view_mm=210.0)
PAGE_MM = (130.0, 100.0)


@pytest.fixture(scope="package")
def simulated():
    return build_rig(Wave(wavelength_mm=90.0), Text(sizes_pt=(10.0,), columns=1, seed=3), PLAN, page_mm=PAGE_MM)


@pytest.fixture(scope="package")
def pictures(simulated):
    return captured(simulated, seed=5)
