"""What a capture may take and what it must detect: its deadline, changes at the scanner, damage without checksums."""

from __future__ import annotations

import itertools
import random
from dataclasses import replace

import pytest

from drivers import SettingsError
from drivers.scanner import MAX_AVERAGE
from drivers.scsi.errors import BadReply
from drivers.vivid900.capture.body import SHOT_S
from drivers.vivid900.capture.camera import CAPTURE_S, PARK_S, capture_limit_s
from drivers.vivid900.errors import DeadlineExceeded, Interrupted, NothingMeasured
from drivers.vivid900.link import COMMAND_S
from drivers.vivid900.profile.commands import ShotMode
from drivers.vivid900.settings import VividSettings
from oracles.faults import FaultRig, count_commands, single_faults, small_profile, without_checksums
from oracles.simulation.device_faults import FAULTS
from oracles.simulation.plate import PlateSensor

SET = VividSettings(mode="fast", distance_mm=900, laser_power=68, gain=0)
DAMAGING = ("corrupt", "stale", "duplicate", "lost", "short", "long", "empty")
SAMPLES, SEED = 12, 3  # of every damaging fault at every command; the whole matrix is `python -m bench.faults`


def test_a_slow_drip_ends_at_the_deadline(stand) -> None:
    camera = stand.camera()
    execute = stand.faulty.execute

    def drip(cdb, data_out, length):
        stand.clock.sleep(0.9 * COMMAND_S)  # each command in time, all of them together never
        return execute(cdb, data_out, length)

    stand.faulty.execute = drip
    start = stand.clock()
    with pytest.raises(DeadlineExceeded, match="30 s") as caught:
        camera.capture(replace(SET, deadline_s=30.0))
    assert stand.clock() - start < 30.0 + COMMAND_S + PARK_S + COMMAND_S
    assert "deadline_s" in caught.value.hint


def test_the_deadline_covers_all_attempts(stand) -> None:
    camera = stand.camera()
    resets = dict.fromkeys(range(0, 10000, 3), FAULTS["was reset"])
    stand.faulty.set_script(resets)
    start = stand.clock()
    with pytest.raises(Interrupted):
        camera.capture(SET)
    assert stand.clock() - start < CAPTURE_S + 3 * PARK_S


def test_the_deadline_is_reported_in_progress(camera) -> None:
    reported: dict[str, list[float]] = {}
    camera.capture(SET, lambda step, done: reported.setdefault(step, []).append(done))
    shares = reported["at most 120 s"]
    assert shares == sorted(shares)
    assert 0 <= shares[0] <= shares[-1] < 0.2


def test_many_shots_have_the_time_that_they_need() -> None:
    assert capture_limit_s(SET) == CAPTURE_S
    assert capture_limit_s(replace(SET, average=MAX_AVERAGE)) > MAX_AVERAGE * SHOT_S[0]
    assert capture_limit_s(replace(SET, average=MAX_AVERAGE, deadline_s=60.0)) == 60.0
    with pytest.raises(SettingsError, match="deadline_s"):
        VividSettings(deadline_s=0.5)


@pytest.mark.parametrize(
    "change", [{"distance_mm": 1100}, {"mode": ShotMode.FINE_COLOUR}, {"laser_power": 90}, {"gain": 3}]
)
def test_a_change_at_the_scanner_during_the_shot_makes_the_capture_fail(stand, change) -> None:
    camera = stand.camera()
    release = stand.device._release

    def released(data: bytes) -> bytes:
        answer = release(data)
        stand.device.parameters = replace(stand.device.parameters, **change)
        return answer

    stand.device._release = released
    with pytest.raises(Interrupted, match=f"{next(iter(change)).replace('_', ' ')} was changed at the scanner"):
        camera.capture(SET)
    stand.device._release = release
    assert camera.capture(SET).measured.all()


def test_what_the_scanner_was_to_choose_may_be_shown_as_chosen(stand) -> None:
    release = stand.device._release

    def released(data: bytes) -> bytes:
        answer = release(data)
        stand.device.parameters = replace(stand.device.parameters, colour=4, threshold=30)
        return answer

    stand.device._release = released
    assert stand.camera().capture(SET).measured.all()


class Dark(PlateSensor):
    """Nothing comes back."""

    def sweep(self, mode, distance_mm, power, gain, shot):
        sums = super().sweep(mode, distance_mm, power, gain, shot)
        return replace(sums, sum=sums.sum * 0, moment=sums.moment * 0, intensity=sums.intensity * 0)


def test_an_empty_range_image_makes_the_capture_fail(make_stand) -> None:
    stand = make_stand(sensor=Dark())
    with stand.camera() as camera, pytest.raises(NothingMeasured, match="measured nothing") as caught:
        camera.capture(SET)
    assert caught.value.hint
    assert stand.device.is_parked


@pytest.fixture(scope="module")
def bare_rig() -> FaultRig:
    return FaultRig(without_checksums(small_profile()))


def test_damage_without_checksums_is_found_by_reading_twice(bare_rig: FaultRig) -> None:
    commands = count_commands(without_checksums(small_profile()))
    scripts = [one for one in single_faults(commands) if one[0] in DAMAGING]
    sample = random.Random(SEED).sample(scripts, SAMPLES)
    found = [(name, *script, bare_rig.run(script).violation) for name, script in sample]
    assert [one for one in found if one[-1]] == []


def test_the_assurance_is_in_the_provenance(make_stand, large_chunks) -> None:
    bare = without_checksums(large_chunks)
    once = bare.model_copy(update={"reads_once": True})
    for profile, integrity in ((large_chunks, "checksum"), (bare, "read_twice"), (once, "read_once")):
        stand = make_stand(profile=profile)
        with stand.camera() as camera:
            reads = len(list(stand.device.log.named("command")))
            scan = camera.capture(SET)
        assert scan.provenance["integrity"] == integrity
        assert scan.measured.all()
        images = [event.detail for event in stand.device.log.named("command")][reads:]
        assert images.count("read_pitch") == (2 if integrity == "read_twice" else 1)


def test_a_block_that_never_repeats_is_refused(make_stand, large_chunks) -> None:
    stand = make_stand(profile=without_checksums(large_chunks))
    with stand.camera() as camera:
        parameters, numbers = stand.device._read_parameters, itertools.count(1)
        stand.device._read_parameters = lambda data, **values: parameters(data)[:-1] + bytes([next(numbers) % 256])
        with pytest.raises(BadReply, match="differently"):
            camera._body().read_parameters()
        stand.device._read_parameters = parameters
