"""A capture over USB while the bus goes wrong: a sample of what `python -m bench.bus_faults` runs in full."""

from __future__ import annotations

import random

import pytest

from drivers.simulated.buses.bulk_only_device import FAULTS
from drivers.vivid900.body import Body
from oracles.bus_faults import BusFaultRig, count_commands
from oracles.faults import small_profile

PLACES, SEED = 2, 5  # commands of the capture for each fault, and for each pair of faults


@pytest.fixture(scope="module")
def commands() -> int:
    return count_commands(small_profile())


@pytest.fixture(scope="module")
def rig() -> BusFaultRig:
    return BusFaultRig(small_profile())


@pytest.mark.parametrize("fault", FAULTS)
def test_one_fault_leaves_the_true_scan_or_a_declared_error_and_the_laser_off(rig, commands, fault):
    for at in random.Random(fault).sample(range(commands), PLACES):
        verdict = rig.run_bus({at: fault})
        assert not verdict.violation, f"{fault} at command {at}: {verdict}"


def test_two_faults_neither(rig, commands):
    rng = random.Random(SEED)
    for _ in range(10):
        first, second = rng.choices(FAULTS, k=2)
        at, later = sorted(rng.sample(range(commands), 2))
        verdict = rig.run_bus({at: first, later: second})
        assert not verdict.violation, f"{first} at {at}, {second} at {later}: {verdict}"


def test_the_rig_finds_a_violation(rig, commands, monkeypatch):
    """A measure that cannot fail measures nothing: a driver that does not put the laser out is found out."""
    monkeypatch.setattr(Body, "laser_off", lambda self: None)
    assert "laser" in rig.run_bus({}).violation
