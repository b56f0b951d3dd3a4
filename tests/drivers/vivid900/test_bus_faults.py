"""A capture over USB and SG_IO while the bus goes wrong: a sample of what `python -m bench.faults` runs in full."""

from __future__ import annotations

import random
from collections.abc import Iterator
from itertools import product

import pytest

from drivers.vivid900.capture.body import Body
from oracles.bus_faults import RIGS
from oracles.faults import FaultRig, Injection, count_commands, pair_injections, small_profile, without_checksums
from oracles.simulation.device_faults import FAULTS as DEVICE_FAULTS

PLACES, SEED, PAIRS = 2, 5, 10  # commands of the capture for each fault; pairs of faults
BUSES = [name for name, rig in RIGS.items() if rig.bus_faults]
BUS_FAULTS = [(bus, fault) for bus in BUSES for fault in RIGS[bus].bus_faults]


@pytest.fixture(scope="module")
def commands() -> int:
    return count_commands(small_profile())


@pytest.fixture(scope="module")
def rigs() -> Iterator[dict[str, FaultRig]]:
    made = {bus: RIGS[bus](small_profile()) for bus in BUSES}
    yield made
    for rig in made.values():
        rig.close()


@pytest.mark.parametrize(("bus", "fault"), BUS_FAULTS)
def test_one_fault_leaves_the_true_scan_or_a_declared_error_and_the_laser_off(rigs, commands, bus, fault):
    for at in random.Random(fault).sample(range(commands), PLACES):
        verdict = rigs[bus].inject(Injection(fault, bus={at: fault}))
        assert not verdict.violation, f"{fault} at command {at}: {verdict}"


@pytest.mark.parametrize(("bus", "fault"), list(product(BUSES, DEVICE_FAULTS)))
def test_a_fault_of_the_device_below_the_bus_is_declared_too(rigs, commands, bus, fault):
    (at,) = random.Random(fault).sample(range(commands), 1)
    verdict = rigs[bus].inject(Injection(fault, device={at: DEVICE_FAULTS[fault]}))
    assert not verdict.violation, f"{fault} at command {at}: {verdict}"


@pytest.mark.parametrize("bus", RIGS)
def test_two_faults_neither_with_checksums_or_without(commands, bus):
    for profile in (small_profile(), without_checksums(small_profile())):
        rig = RIGS[bus](profile)
        for injection in pair_injections(RIGS[bus], commands, PAIRS, random.Random(SEED)):
            verdict = rig.inject(injection)
            assert not verdict.violation, f"{injection}: {verdict}"
        rig.close()


@pytest.mark.parametrize("bus", BUSES)
def test_the_rig_finds_a_violation(rigs, bus, monkeypatch):
    """A measure that cannot fail measures nothing: a driver that does not put the laser out is found out."""
    monkeypatch.setattr(Body, "laser_off", lambda self: None)
    assert "laser" in rigs[bus].inject(Injection("none")).violation
