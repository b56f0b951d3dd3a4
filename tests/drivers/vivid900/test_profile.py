"""Command profiles: what a file may say, and for whom it is."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.scanner import SettingsError
from drivers.vivid900.cdb import Layout
from drivers.vivid900.errors import ProfileMismatch
from drivers.vivid900.panel import PANELS
from drivers.vivid900.profile import PROFILES, SIMULATED, Profile, load_profile, parse_profile
from drivers.vivid900.scsi import Identity

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
        (changed("commands", "release", to=None), "commands.release"),
        (changed("commands", "release", to="C3 00"), "6 to 16"),
        (changed("commands", "release", to="C3 00 0 00 00 00"), "'0' is neither"),
        (changed("commands", "release", to="length/2 00 00 00 00 00"), "first byte is fixed"),
        (changed("commands", "release", to="C3 length/2 00 00 00"), "release has the fields"),
        (changed("commands", "read_pitch", to="C5 00 length/3 00"), "must have"),
        (changed("commands", "release", to="C4 00 00 00 00 00 00 00 00 00"), "can be the same bytes"),
        (changed("blocks", "parameters", "length", to=4), "beyond the end"),
        (changed("blocks", "parameters", "length", to=1 << 30), "blocks.parameters.length"),
        (changed("blocks", "parameters", "fields", "gain", to=None), "gain"),
        (changed("blocks", "parameters", "fields", "gain", to={"at": 0, "bytes": 1}), "overlap"),
        (changed("blocks", "pitch", "fields", "magic", "value", to=1 << 40), "does not fit"),
        (changed("pitch", "pixel", to=[["sum", "u4"], ["sum", "u4"], ["intensity", "u1"]]), "each once"),
        (changed("pitch", "pixel", to=[["sum", "f8"]]), "pitch.pixel"),
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


FIELD = st.tuples(st.sampled_from(["offset", "length", "kind"]), st.integers(1, 4))


@given(st.binary(min_size=6, max_size=8), st.lists(FIELD, unique_by=lambda field: field[0]), st.data())
def test_a_cdb_is_read_back(fixed: bytes, fields: list[tuple[str, int]], data: st.DataObject) -> None:
    words = [f"{byte:02X}" for byte in fixed] + [f"{name}/{size}" for name, size in fields]
    total = len(fixed) + sum(size for _, size in fields)
    if total > 16:
        with pytest.raises(ValueError, match="CDB"):
            Layout.read(" ".join(words))
        return
    layout = Layout.read(" ".join(words))
    values = {name: data.draw(st.integers(0, (1 << 8 * size) - 1)) for name, size in fields}
    cdb = layout.build(**values)
    assert len(cdb) == total
    assert layout.parse(cdb) == values
    assert layout.parse(bytes([cdb[0] ^ 1]) + cdb[1:]) is None
    assert layout.overlaps(layout)


def test_a_profile_is_data_alone() -> None:
    """Nothing but the file decides the bytes: another opcode is another command."""
    other: Profile = parse_profile(changed("commands", "release", to="D7 00 00 00 00 01"))
    assert other.commands.release.build() == bytes.fromhex("d7 00 00 00 00 01")
