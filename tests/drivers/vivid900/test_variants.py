"""A scanner of each variant of the profile gives the same scan, at rest afterwards, through the same driver."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.scanner import SettingsError
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.errors import BarrierClosed, HardwareFault, Interrupted, PanelError, StillBusy
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES
from drivers.vivid900.profile.commands import ShotMode
from drivers.vivid900.profile.profile import PROFILES, Profile, load_profile
from drivers.vivid900.settings import VividSettings
from restore.scan import RangeScan

VARIANTS = sorted((PROFILES / "variants").glob("*.toml"))
SET = VividSettings(mode="fast", distance_mm=900, laser_power=68)


def large(path: Path | str) -> Profile:
    return load_profile(path).model_copy(update={"chunk_bytes": 1 << 20})


@pytest.fixture(scope="module")
def truth(make_stand) -> RangeScan:
    with make_stand().camera() as camera:
        return camera.capture(SET)


def test_there_are_at_least_a_dozen() -> None:
    assert len(VARIANTS) >= 12
    assert len({load_profile(path).name for path in VARIANTS}) == len(VARIANTS)
    assert all(load_profile(path).name == path.stem and load_profile(path).trusted for path in VARIANTS)


@pytest.mark.parametrize("path", VARIANTS, ids=lambda path: path.stem)
def test_the_scan_is_the_same_to_the_byte(path, make_stand, truth) -> None:
    stand = make_stand(profile=large(path))
    with stand.camera() as camera:
        scan = camera.capture(SET)
        again = camera.capture(SET)
    assert scan.points.tobytes() == truth.points.tobytes()
    assert scan.texture.tobytes() == truth.texture.tobytes()
    assert not np.array_equal(again.texture, truth.texture)  # of its own shot
    assert stand.device.is_parked
    assert scan.provenance["integrity"] == load_profile(path).integrity


@pytest.mark.parametrize("path", VARIANTS, ids=lambda path: path.stem)
def test_in_small_chunks_too(path, make_stand, truth) -> None:
    stand = make_stand(profile=load_profile(path))
    with stand.camera() as camera:
        assert camera.capture(SET).points.tobytes() == truth.points.tobytes()


@pytest.mark.parametrize("path", VARIANTS, ids=lambda path: path.stem)
def test_a_scanner_that_chooses_by_itself(path, make_stand) -> None:
    profile = large(path)
    stand = make_stand(profile=profile)
    with stand.camera() as camera:
        if "pitch.intensity" in profile.absences:
            with pytest.raises(SettingsError, match="brightness") as refused:
                camera.capture(VividSettings(mode="fast", distance_mm=900))
            assert "laser_power" in refused.value.hint
        else:
            assert camera.capture(VividSettings(mode="fast", distance_mm=900)).measured.all()
        if {"commands.passive_autofocus", "commands.active_autofocus"} <= profile.absences.keys():
            with pytest.raises(SettingsError, match="no autofocus"):
                camera.capture(replace(SET, distance_mm=None))
        else:
            found = camera.capture(replace(SET, distance_mm=None))
            assert abs(found.provenance["distance_mm"] - 900) < 5


@pytest.mark.parametrize("path", VARIANTS, ids=lambda path: path.stem)
def test_the_laser_barrier_and_the_panel_are_reported(path, make_stand) -> None:
    stand = make_stand(profile=large(path))
    with stand.camera() as camera:
        stand.device.barrier = True
        with pytest.raises(BarrierClosed):
            camera.capture(SET)
        stand.device.barrier, stand.device.fails = False, "LIGHT IMPROPER"
        reported = "panel" in stand.profile.blocks.status.fields or "LIGHT IMPROPER" in stand.profile.sense.values()
        with pytest.raises(PanelError if reported else HardwareFault):
            camera.capture(SET)
        assert camera.capture(SET).measured.all()
    assert stand.device.is_parked


def test_a_scanner_that_stays_busy_without_a_status_command(make_stand) -> None:
    stand = make_stand(profile=large("variants/no-status"))
    with stand.camera() as camera:
        stand.device.power_off()
        assert camera.state == "off"
        stand.device.power_on()
        assert camera.state == "warming-up"
        stand.clock.sleep(60)
        assert camera.state == "ready"
        stand.device._busy_until = stand.clock() + 1000
        assert camera.state == "busy"
        with pytest.raises(StillBusy):
            camera.capture(SET)
        stand.device._busy_until = stand.clock()


def test_images_with_a_shot_number_are_compared_even_without_a_status(make_stand) -> None:
    stand = make_stand(profile=large("variants/no-status"))
    with stand.camera() as camera:
        camera.capture(SET)
        old = stand.device._record.colour
        part = stand.device._part
        stand.device._part = lambda image, block, **span: part(image, old if image == "colour" else block, **span)
        with pytest.raises(Interrupted, match="another capture"):
            camera.capture(SET)
        stand.device._part = part


def test_a_lens_that_is_not_reported_has_to_be_named(make_stand) -> None:
    stand = make_stand(profile=large("variants/no-status"))
    stand.known = calibrations(None)
    with stand.camera() as camera, pytest.raises(SettingsError, match="which lens") as refused:
        camera.capture(SET)
    assert "lens =" in refused.value.hint
    stand.known = lambda status: nominal(LENSES["MIDDLE"])
    with stand.camera() as camera:
        assert camera.capture(SET).provenance["lens"] == "MIDDLE"


def test_without_a_colour_image_the_scan_has_none(make_stand, large_chunks, truth) -> None:
    commands = {name: written for name, written in large_chunks.commands.items() if name != "read_colour"}
    stand = make_stand(profile=large_chunks.model_copy(update={"commands": commands}))
    with stand.camera() as camera:
        scan = camera.capture(replace(SET, average=2))
        with pytest.raises(SettingsError, match="no read_colour"):
            camera.photograph()
    assert scan.texture is None
    assert scan.measured.all()


def test_a_mode_without_a_number_is_refused(make_stand) -> None:
    stand = make_stand(profile=large("variants/other-numbers"))
    with stand.camera() as camera:
        assert camera.photograph(ShotMode.COLOUR_8).shape == (480, 640, 3)
        with pytest.raises(SettingsError, match="no mode COLOUR_10"):
            camera.photograph(ShotMode.COLOUR_10)


def test_a_gain_that_cannot_be_written_is_refused(make_stand) -> None:
    with (
        make_stand(profile=large("variants/no-autofocus")).camera() as camera,
        pytest.raises(SettingsError, match="gain"),
    ):
        camera.capture(replace(SET, gain=3))
