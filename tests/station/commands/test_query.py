"""`planish query`: a profile in progress asks, and nothing is written before its owner trusts it."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.vivid900.profile.profile import PROFILES, SIMULATED, load_profile
from oracles.served_device import served
from oracles.simulation.plate import PlateSensor
from station.cli import main

DRAFT = """
name = "draft"
[firmware]
vendor = "PLANISH"
product = "SIM VIVID 900"
revisions = ["0.?"]
[commands]
read_parameters = "C0 00 00 00 00 00 00 length/2 00"
release = "C3 00 00 00 00 00 00 00 00 00"
[blocks.parameters]
length = 16
fields = { distance_mm = { at = 0, bytes = 2 } }
"""


@pytest.fixture
def device():
    device = SimulatedDevice(Lens("MIDDLE", 14, PlateSensor()), load_profile(SIMULATED), VirtualClock())
    with served(device) as device.port:
        yield device


@pytest.fixture
def station(device, tmp_path):
    """Write a station's configuration for a profile."""

    def station(profile: str) -> str:
        path = tmp_path / "station.toml"
        transport = f'transport = {{ kind = "socket", port = {device.port} }}'
        path.write_text(f'[scanner]\ndriver = "vivid900"\nprofile = "{profile}"\n{transport}\n')
        return str(path)

    return station


@pytest.fixture
def draft(tmp_path) -> Path:
    path = tmp_path / "draft.toml"
    path.write_text(DRAFT)
    return path


def sent(device) -> set[str]:
    return {event.detail for event in device.log.named("command")}


def test_blocks_are_shown_with_their_bytes_and_fields(station, device, capsys):
    assert main(["query", "--config", station(SIMULATED)]) == 0
    reported = capsys.readouterr().out.splitlines()
    assert reported[:2] == ["PLANISH SIM VIVID 900 0.9", f"profile {SIMULATED}: trusted"]
    assert "  lens = 2 (MIDDLE)" in reported
    assert "  distance_mm = 1000" in reported
    assert any(line.startswith("read_parameters: 03 e8 00") for line in reported)
    assert not sent(device) & {"write_parameters", "release", "active_autofocus"}


def test_a_draft_asks_and_says_what_is_missing(station, draft, device, capsys):
    assert main(["query", "--config", station(str(draft))]) == 0
    reported = capsys.readouterr().out
    assert "not trusted" in reported
    assert "has to be found out: commands.write_parameters, commands.read_pitch" in reported
    assert "TEST UNIT READY reports: ready" in reported
    assert "distance_mm = 1000" in reported
    assert sent(device) <= {"read_parameters", "12 00 00 00 24 00", "00 00 00 00 00 00", "03 00 00 00 12 00"}


@pytest.mark.parametrize(("command", "code"), [("scan", 2), ("park", 4)])
def test_nothing_is_written_with_a_profile_that_is_not_trusted(command, code, station, tmp_path, device, capsys):
    whole = (PROFILES / f"{SIMULATED}.toml").read_text("utf-8")
    profile = tmp_path / "whole.toml"
    profile.write_text(whole.replace("trusted = true", "trusted = false"))
    output = ["-o", str(tmp_path / "out")] if command == "scan" else []
    assert main([command, "--config", station(str(profile)), *output]) == code
    reported = capsys.readouterr().err
    assert "not trusted yet" in reported
    assert "trusted = true" in reported
    assert not sent(device) & {"write_parameters", "release", "active_autofocus", "passive_autofocus", "read_pitch"}


def test_a_block_that_cannot_be_read_is_shown_with_the_reason(station, tmp_path, draft, capsys):
    text = draft.read_text().replace("length = 16", 'length = 16\nchecksum = { kind = "sum8", at = 15 }')
    draft.write_text(text)
    assert main(["query", "--config", station(str(draft))]) == 0
    assert "checksum" in capsys.readouterr().out
    draft.write_text(DRAFT.replace("C0 00", "CF 00"))
    assert main(["query", "--config", station(str(draft))]) == 0
    assert "does not know" in capsys.readouterr().out


def test_another_scanner_is_not_asked(station, draft, device, capsys):
    draft.write_text(DRAFT.replace("SIM VIVID", "VIVID"))
    assert main(["query", "--config", station(str(draft))]) == 4
    assert "is for PLANISH VIVID 900" in capsys.readouterr().err
    assert "read_parameters" not in sent(device)


def test_the_simulated_station_answers_too(tmp_path, capsys):
    config = tmp_path / "simulated.toml"
    config.write_text('[scanner]\ndriver = "simulated"\nprofile = "variants/no-status"\n')
    assert main(["query", "--config", str(config)]) == 0
    reported = capsys.readouterr().out
    assert "profile no-status: trusted" in reported
    assert "without commands.status: TEST UNIT READY is polled" in reported
