"""Command profiles: what a file may say, and for whom it is."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path
from typing import Any

import pytest

from drivers.scanner import SettingsError
from drivers.scsi.commands import Identity
from drivers.vivid900.errors import NotTrusted, ProfileMismatch
from drivers.vivid900.faults import PANELS
from drivers.vivid900.profile.contents import REQUIRED
from drivers.vivid900.profile.profile import PROFILES, SIMULATED, Profile, load_profile, parse_profile

SOURCE = PROFILES / f"{SIMULATED}.toml"
TABLE = tomllib.loads(SOURCE.read_text("utf-8"))


def changed(*path: str, to: Any) -> dict[str, Any]:
    table = copy.deepcopy(TABLE)
    inner = table
    for key in path[:-1]:
        inner = inner[key]
    if to is None:
        del inner[path[-1]]
    else:
        inner[path[-1]] = to
    return table


def test_the_default_profile_says_that_it_is_not_the_vendors() -> None:
    text = SOURCE.read_text("utf-8")
    assert "NOT THE VENDOR'S" in text
    profile = load_profile(SIMULATED)
    assert profile.name == SIMULATED
    assert profile.firmware.vendor == "PLANISH"
    assert set(profile.panels) == set(PANELS)


@pytest.mark.parametrize(
    "identity",
    [
        Identity(6, "MINOLTA", "VIVID 900", "1.00"),
        Identity(6, "MINOLTA", "SIM VIVID 900", "0.9"),
        Identity(3, "PLANISH", "SIM VIVID 900", "1.0"),
        Identity(3, "", "", ""),
    ],
)
def test_it_is_for_no_real_scanner(identity: Identity) -> None:
    with pytest.raises(ProfileMismatch, match="is for PLANISH SIM VIVID 900") as refused:
        load_profile(SIMULATED).require(identity)
    assert "profile" in refused.value.hint


def test_a_profile_is_for_the_revisions_that_it_names() -> None:
    firmware = load_profile(SIMULATED).firmware.model_copy(update={"revisions": ("1.0?", "2.1")})
    fits = {revision for revision in ("1.00", "1.07", "1.10", "2.1", "2") if firmware.fits(
        Identity(6, "PLANISH", "SIM VIVID 900", revision))}  # fmt: skip
    assert fits == {"1.00", "1.07", "2.1"}


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        (changed("name", to=None), "name"),
        (changed("firmware", "revisions", to=[]), "firmware.revisions"),
        (changed("commands", "release", to=None), "needs commands.release"),
        (changed("commands", "launch", to="C9 00 00 00 00 00"), "commands.launch"),
        (changed("commands", "release", to="12 00 00 00 00 00"), "every SCSI device"),
        (changed("commands", "release", to="C3 00"), "6 to 16"),
        (changed("commands", "release", to="C3 00 0 00 00 00"), "'0' is neither"),
        (changed("commands", "release", to="length/2 00 00 00 00 00"), "first byte is fixed"),
        (changed("commands", "release", to="C3 length/2 00 00 00"), "release has the fields"),
        (changed("commands", "release", to={"cdb": "C3 00 00 00 00 00", "out": "length/2"}), "release has the fields"),
        (changed("commands", "read_pitch", to="C5 length/3 length/3 00"), "twice"),
        (changed("commands", "release", to="C4 00 00 00 00 00 00 00 00 00"), "can be the same bytes"),
        (changed("blocks", "parameters", "length", to=4), "beyond the end"),
        (changed("blocks", "parameters", "length", to=1 << 30), "blocks.parameters.length"),
        (changed("blocks", "parameters", "fields", "laser_power", to=None), "needs blocks.parameters.laser_power"),
        (changed("blocks", "parameters", "fields", "mode", to=None), "needs mode"),
        (changed("blocks", "status", "fields", "state", to=None), "needs blocks.status.state"),
        (changed("states", "ready", to=None), "needs states.ready"),
        (changed("blocks", "parameters", "fields", "gain", to={"at": 0, "bytes": 1}), "overlap"),
        (changed("blocks", "pitch", "fields", "magic", "value", to=1 << 40), "does not fit"),
        (changed("pitch", "pixel", to=[["sum", "u4"], ["sum", "u4"], ["intensity", "u1"]]), "each once"),
        (changed("pitch", "pixel", to=[["sum", "u4"], ["frame", "u4"]]), "each once"),
        (changed("pitch", "pixel", to=[["sum", "f8"]]), "pitch.pixel"),
        (changed("pitch", "pixel", to=[]), "needs pitch.pixel"),
        (changed("colour", "channels", to="RGX"), "each once"),
        (changed("modes", to={"SLOW": 1}), "modes.SLOW"),
        (changed("states", "ready", to=4), "same value"),
        (changed("sense", to={"80": "SYSTEM ERROR"}), "code/qualifier"),
        (changed("sense", to={"zz/01": "SYSTEM ERROR"}), "profile"),
        (changed("opcode", to=3), "opcode"),
    ],
)
def test_a_profile_that_cannot_be_is_refused_by_name(table: dict[str, Any], complaint: str) -> None:
    with pytest.raises(SettingsError) as refused:
        parse_profile(table)
    assert complaint in str(refused.value)


def test_a_file_that_is_not_there_or_no_toml_is_refused(tmp_path: Path) -> None:
    (tmp_path / "broken.toml").write_text("name = ")
    for name in ("no-such-profile", tmp_path / "none.toml", tmp_path / "broken.toml"):
        with pytest.raises(SettingsError, match=Path(name).stem):
            load_profile(name)


def test_the_station_configuration_for_a_real_scanner_names_no_profile_that_comes_with_planish() -> None:
    from station.config import load_config

    config = load_config(PROFILES.parent / "vivid900.toml")
    assert config.scanner["driver"] == "vivid900"
    assert not Path(config.scanner["profile"]).exists()


def test_what_a_profile_does_without_has_its_consequence() -> None:
    assert load_profile(SIMULATED).absences == {}
    bare = parse_profile(changed("commands", "status", to=None))
    assert set(bare.absences) == {"commands.status"}
    without = parse_profile(changed("blocks", "status", "fields", "shot", to=None))
    assert "no check" in without.absences["blocks.status.shot"]


def test_a_profile_in_progress_may_lack_anything_but_its_firmware() -> None:
    draft = parse_profile({"name": "draft", "firmware": TABLE["firmware"]})
    assert not draft.trusted
    assert set(REQUIRED) == set(draft.lacking)
    with pytest.raises(NotTrusted, match="release is not sent") as refused:
        draft.require_trust("release")
    assert "trusted = true" in refused.value.hint


def test_a_profile_based_on_another_is_that_less_and_more(tmp_path: Path) -> None:
    (tmp_path / "base.toml").write_text(SOURCE.read_text("utf-8"))
    mine = tmp_path / "mine.toml"
    mine.write_text('based_on = "base.toml"\nwithout = ["commands.status", "panels"]\n[states]\nready = 9\n')
    profile = load_profile(mine)
    assert "status" not in profile.commands
    assert (profile.panels, profile.states["ready"], profile.states["busy"]) == ({}, 9, 4)
    mine.write_text('based_on = "base.toml"\nwithout = ["commands.launch"]\n')
    with pytest.raises(SettingsError, match=r"commands\.launch is not in the profile"):
        load_profile(mine)
    mine.write_text('based_on = "mine.toml"\n')
    with pytest.raises(SettingsError, match="based_on"):
        load_profile(mine)


def test_a_profile_is_data_alone() -> None:
    """Nothing but the file decides the bytes: another opcode is another command."""
    other: Profile = parse_profile(changed("commands", "release", to="D7 00 00 00 00 01"))
    assert other.commands["release"].cdb.build({}) == bytes.fromhex("d7 00 00 00 00 01")
