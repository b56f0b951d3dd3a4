"""`planish trace`: what it prints and writes, and how it ends."""

from __future__ import annotations

import json
import os
import tomllib
from pathlib import Path

import pytest

from drivers.scsi.bulk_only import CommandWrapper, StatusWrapper, build_command, build_status
from drivers.scsi.commands import Identity, inquiry
from oracles.simulation.buses.capture import Urb, write_capture
from oracles.simulation.buses.usb_descriptors import BULK_IN, BULK_OUT
from station.cli import main
from tests.drivers.trace import by_hand
from tests.drivers.trace.by_hand import Said

VIVID = Identity(6, "MINOLTA", "VIVID 900", "1.00")


@pytest.fixture
def capture(tmp_path) -> Path:
    """An INQUIRY and its answer."""
    wrapper = CommandWrapper(1, 36, True, 0x50, inquiry())
    urbs = [
        Urb(BULK_OUT, build_command(wrapper), 31),
        Urb(BULK_IN, VIVID.build(), 36),
        Urb(BULK_IN, build_status(StatusWrapper(1, 0, 0)), 13),
    ]
    path = tmp_path / "vendor.pcapng"
    with path.open("wb") as file:
        write_capture(file, urbs)
    return path


def test_commands_are_listed(capture, capsys):
    assert main(["trace", str(capture)]) == 0
    first, *_ = capsys.readouterr().out.splitlines()
    assert first.split()[:8] == ["0", "in", "12", "00", "00", "00", "24", "00"]
    assert "36/36" in first


def test_as_json(capture, capsys):
    assert main(["trace", str(capture), "--json"]) == 0
    (command,) = json.loads(capsys.readouterr().out)["commands"]
    assert (command["name"], command["head"]) == ("INQUIRY", VIVID.build().hex())


def test_a_draft_is_written_and_not_overwritten(capture, tmp_path, capsys):
    draft = tmp_path / "my-vivid900.toml"
    assert main(["trace", str(capture), "--draft", str(draft)]) == 0
    reported = tomllib.loads(draft.read_text("utf-8"))
    assert reported["name"] == "my-vivid900"
    assert reported["firmware"] == {"vendor": "MINOLTA", "product": "VIVID 900", "revisions": ["1.00"]}
    draft.write_text("worked on for days")
    assert main(["trace", str(capture), "--draft", str(draft)]) == 2
    assert draft.read_text() == "worked on for days"
    assert main(["trace", str(capture), "--draft", str(draft), "--force"]) == 0
    assert draft.read_text() != "worked on for days"


def test_a_damaged_capture_is_bad_input(capture, tmp_path, capsys):
    capture.write_bytes(capture.read_bytes()[:60])
    assert main(["trace", str(capture), "--draft", str(tmp_path / "draft.toml")]) == 3
    reported, hint = capsys.readouterr().err.splitlines()
    assert reported.startswith("planish: ")
    assert "capture" in hint
    assert not (tmp_path / "draft.toml").exists()


@pytest.fixture
def series(tmp_path) -> list[str]:
    """Captures of a write of four bytes, whose second one is 20, 21 and 40."""
    write = bytes.fromhex("C1 00 00 00 04 00")
    said = {value: [Said(write, sent=bytes([1, value, 2, 3]))] for value in (20, 21, 40)}
    return [str(by_hand.write(tmp_path / f"{value}.pcapng", one)) for value, one in said.items()]


def test_two_captures_are_compared(series, capsys):
    assert main(["trace", *series[:2]]) == 0
    assert capsys.readouterr().out == "write_parameters (C1 00 00) sent, byte 1: 14 → 15\n"


def test_the_field_of_a_setting_is_named(series, capsys):
    assert main(["trace", *series, "--setting", "laser_power=20,21,40"]) == 0
    assert capsys.readouterr().out == "write_parameters (C1 00 00) sent: laser_power = { at = 1 }\n"
    assert main(["trace", *series, "--setting", "laser_power=20,22,40"]) == 0
    assert "was laser_power set" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "code", "hint"),
    [
        ([], 2, "--setting gain=0,1,3"),
        (["--setting", "gain"], 2, "distance_mm=600,900,1200"),
        (["--setting", "gain=a,b,c"], 2, "distance_mm=600,900,1200"),
        (["--setting", "gain=0,1"], 3, "each capture's value"),
    ],
)
def test_comparisons_that_cannot_be_say_what_to_do(series, arguments, code, hint, capsys):
    assert main(["trace", *series, *arguments]) == code
    assert hint in capsys.readouterr().err


def test_a_draft_of_several_captures_has_the_evidence_of_all(series, tmp_path, capsys):
    draft = tmp_path / "mine.toml"
    assert main(["trace", *series[:2], "--draft", str(draft)]) == 0
    assert draft.read_text("utf-8").count("# seen: 01") == 2


def test_a_queue_is_refused(tmp_path, capsys):
    os.mkfifo(tmp_path / "queue")
    assert main(["trace", str(tmp_path / "queue")]) == 3
    assert "not a file" in capsys.readouterr().err
