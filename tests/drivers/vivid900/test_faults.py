"""Faults below the driver: always the true scan or a declared error, never a hang; at rest, and ready for the next."""

from __future__ import annotations

import random

import pytest

from oracles.faults import FaultRig, count_commands, fault_pairs, single_faults, small_profile
from oracles.simulation.device_faults import FAULTS, no_fault

FEW_PAIRS, SEED = 20, 5
ALL_PAIRS = 400


@pytest.fixture(scope="module")
def rig() -> FaultRig:
    return FaultRig(small_profile())


@pytest.fixture(scope="module")
def commands() -> int:
    return count_commands(small_profile())


def test_a_capture_without_faults_is_a_scan(rig: FaultRig) -> None:
    verdict = rig.run({})
    assert (verdict.outcome, verdict.violation) == ("scan", "")


@pytest.mark.parametrize("name", FAULTS)
def test_each_fault_at_some_command(rig: FaultRig, commands: int, name: str) -> None:
    at = random.Random(f"{SEED} {name}").randrange(commands)
    assert rig.run({at: FAULTS[name]}).violation == "", f"at command {at}"


def test_a_sample_of_pairs(rig: FaultRig, commands: int) -> None:
    found = [
        (name, sorted(script), rig.run(script).violation)
        for name, script in fault_pairs(commands, FEW_PAIRS, random.Random(SEED))
    ]
    assert [one for one in found if one[2]] == []


@pytest.mark.slow
def test_every_fault_at_every_command(rig: FaultRig, commands: int) -> None:
    found = [(name, *script, rig.run(script).violation) for name, script in single_faults(commands)]
    assert len(found) == commands * len(FAULTS)
    assert [one for one in found if one[-1]] == []


@pytest.mark.slow
def test_many_pairs(rig: FaultRig, commands: int) -> None:
    found = [
        (name, sorted(script), rig.run(script).violation)
        for name, script in fault_pairs(commands, ALL_PAIRS, random.Random(0))
    ]
    assert [one for one in found if one[2]] == []


def test_the_verdict_can_be_wrong(rig: FaultRig) -> None:
    """A laser left on, an old scan and a stage that turns on would be seen."""
    shot = rig.device.shot
    scan = rig.camera.capture(rig.settings)
    assert rig.scan_violation(scan, rig.device.shot) == "an earlier shot"
    assert rig.scan_violation(scan, shot) == ""
    rig.device.log.laser_on(rig.clock(), 100.0, 9)
    assert rig.rest_violation(rig.clock()) == "the laser is on"
    rig.device.log.laser_off()
    rig.stops = 0
    assert rig.rest_violation(rig.clock()) == "the stage was not stopped"
    assert no_fault not in FAULTS.values()
