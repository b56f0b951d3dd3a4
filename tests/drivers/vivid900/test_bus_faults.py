"""A capture over USB while the bus goes wrong: a sample of what `python -m bench.bus_faults` runs in full."""

from __future__ import annotations

import random

import pytest

from bench.bus_faults import BridgedStand, length_of_capture
from bench.faults import small_profile
from drivers.simulated.buses.bulk_only_device import FAULTS
from drivers.vivid900.body import Body

PLACES, SEED = 2, 5  # commands of the capture for each fault, and for each pair of faults


@pytest.fixture(scope="module")
def commands() -> int:
    return length_of_capture(small_profile())


@pytest.fixture(scope="module")
def stand() -> BridgedStand:
    return BridgedStand(small_profile())


@pytest.mark.parametrize("fault", FAULTS)
def test_one_fault_leaves_the_true_scan_or_a_declared_error_and_the_laser_off(stand, commands, fault):
    for at in random.Random(fault).sample(range(commands), PLACES):
        verdict = stand.run_bus({at: fault})
        assert not verdict.wrong, f"{fault} at command {at}: {verdict}"


def test_two_faults_neither(stand, commands):
    rng = random.Random(SEED)
    for _ in range(10):
        first, second = rng.choices(FAULTS, k=2)
        at, later = sorted(rng.sample(range(commands), 2))
        verdict = stand.run_bus({at: first, later: second})
        assert not verdict.wrong, f"{first} at {at}, {second} at {later}: {verdict}"


def test_the_stand_sees_what_is_wrong(stand, commands, monkeypatch):
    """A measure that cannot fail measures nothing: a driver that does not put the laser out is found out."""
    monkeypatch.setattr(Body, "laser_off", lambda self: None)
    assert "laser" in stand.run_bus({}).wrong
