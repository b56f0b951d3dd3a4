"""Faults below the driver: always the true scan or a declared error, never a hang; at rest, and ready for the next."""

from __future__ import annotations

import random

import pytest

from bench.faults import Stand, length_of_capture, pairs, singles, small_profile
from drivers.simulated.faults import FAULTS, passed_on

FEW_PAIRS, SEED = 20, 5
ALL_PAIRS = 400


@pytest.fixture(scope="module")
def stand() -> Stand:
    return Stand(small_profile())


@pytest.fixture(scope="module")
def commands() -> int:
    return length_of_capture(small_profile())


def test_a_capture_without_faults_is_a_scan(stand: Stand) -> None:
    verdict = stand.run({})
    assert (verdict.outcome, verdict.wrong) == ("scan", "")


@pytest.mark.parametrize("name", FAULTS)
def test_each_fault_at_some_command(stand: Stand, commands: int, name: str) -> None:
    at = random.Random(f"{SEED} {name}").randrange(commands)
    assert stand.run({at: FAULTS[name]}).wrong == "", f"at command {at}"


def test_a_sample_of_pairs(stand: Stand, commands: int) -> None:
    found = [
        (name, sorted(script), stand.run(script).wrong)
        for name, script in pairs(commands, FEW_PAIRS, random.Random(SEED))
    ]
    assert [one for one in found if one[2]] == []


@pytest.mark.slow
def test_every_fault_at_every_command(stand: Stand, commands: int) -> None:
    found = [(name, *script, stand.run(script).wrong) for name, script in singles(commands)]
    assert len(found) == commands * len(FAULTS)
    assert [one for one in found if one[-1]] == []


@pytest.mark.slow
def test_many_pairs(stand: Stand, commands: int) -> None:
    found = [
        (name, sorted(script), stand.run(script).wrong) for name, script in pairs(commands, ALL_PAIRS, random.Random(0))
    ]
    assert [one for one in found if one[2]] == []


def wrong_pairs(stand: Stand, commands: int, number: int) -> list[tuple[str, list[int], str]]:
    sample = pairs(commands, number, random.Random(SEED))
    found = [(name, sorted(script), stand.run(script).wrong) for name, script in sample]
    return [one for one in found if one[2]]


def test_the_verdict_can_be_wrong(stand: Stand) -> None:
    """A laser left on, an old scan and a stage that turns on would be seen."""
    shot = stand.device.shot
    scan = stand.camera.capture(stand.settings)
    assert stand.wrong(scan, stand.device.shot) == "an earlier shot"
    assert stand.wrong(scan, shot) == ""
    stand.device.log.burn(stand.clock(), 100.0, 9)
    assert stand.unrest(stand.clock()) == "the laser is on"
    stand.device.log.cut_off()
    stand.stops = 0
    assert stand.unrest(stand.clock()) == "the stage was not stopped"
    assert passed_on not in FAULTS.values()
