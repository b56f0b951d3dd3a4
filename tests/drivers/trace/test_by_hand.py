"""Captures that share no code with the reader: commands of its own, and the vendor's session with every variant."""

from __future__ import annotations

import os
import tomllib

import pytest

from drivers.scsi.in_process import InProcess
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.trace import CaptureError
from drivers.trace.capture import read_transfers
from drivers.trace.compare import find_field, list_changes, list_field
from drivers.trace.draft import draft_profile
from drivers.trace.exchanges import read_exchanges
from drivers.trace.groups import group
from drivers.trace.roles import guess_roles
from drivers.vivid900.capture.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.link import Link
from drivers.vivid900.profile.profile import PROFILES, load_profile, parse_profile
from drivers.vivid900.settings import VividSettings
from oracles.simulation.plate import PlateSensor
from tests.drivers.trace.by_hand import RECORDS, Listener, Said, write

SET = VividSettings(mode="fast", distance_mm=900, laser_power=68)
LINK_TYPES = sorted(RECORDS)
# Without offsets, little-endian, with data for the release, under one operation code, at odd sizes.
UNLIKE = (
    "type-codes",
    "little-endian",
    "bare",
    "windows",
    "mode-pages",
    "planar",
    "words",
    "weak-checksums",
    "bit-fields",
)


def session(variant: str, *settings: VividSettings, sensor=None) -> list[Said]:
    """What a program that knows the variant says to a scanner of it."""
    clock, profile = VirtualClock(), load_profile(f"variants/{variant}")
    listener = Listener(SimulatedDevice(Lens("MIDDLE", 14, sensor or PlateSensor()), profile, clock))
    link = Link(InProcess(listener), None, clock, clock.sleep)
    with Vivid900(link, profile, calibrations(None, lens="MIDDLE")) as scanner:
        for one in settings:
            scanner.capture(one)
    return listener.said


def exchanges_of(said, path, link_type=249):
    return read_exchanges(read_transfers(write(path, said, link_type)))


@pytest.mark.parametrize("link_type", LINK_TYPES)
def test_what_was_said_is_read(link_type, tmp_path):
    said = [
        Said(bytes.fromhex("12 00 00 00 24 00"), came=bytes(36), asked=36),
        Said(bytes.fromhex("C1 00 00 00 00 00 00 00 10 00"), sent=bytes(range(16))),
        Said(bytes.fromhex("C3 00 00 00 00 00"), status=2),
        Said(bytes.fromhex("03 00 00 00 12 00"), came=bytes.fromhex("70 00 05") + bytes(15), asked=18),
        Said(bytes.fromhex("28 00 80 00 00 00 00 C3 50 00"), came=bytes(50_000), asked=50_000),
        Said(bytes.fromhex("28 00 80 00 00 00 00 C3 50 00"), came=bytes(10), asked=50_000),
    ]
    found = exchanges_of(said, tmp_path / "said.pcapng", link_type)
    assert [e.cdb for e in found] == [one.cdb for one in said]
    assert [e.data for e in found] == [one.sent or one.came for one in said]
    assert [e.asked for e in found] == [36, 16, 0, 18, 50_000, 50_000]
    assert [e.moved for e in found] == [36, 16, 0, 18, 50_000, 10]
    assert [e.direction for e in found] == ["in", "out", "none", "in", "in", "in"]
    assert found[2].sense[:3] == bytes.fromhex("70 00 05")
    assert [e.number for e in found] == list(range(6))


@pytest.mark.parametrize("link_type", LINK_TYPES)
@pytest.mark.parametrize("variant", UNLIKE)
def test_the_draft_has_the_commands_and_the_packing(variant, link_type, tmp_path):
    found = exchanges_of(session(variant, SET), tmp_path / "one.pcapng", link_type)
    true, draft = load_profile(f"variants/{variant}"), tomllib.loads(draft_profile(found, name="draft"))
    drafted = parse_profile(draft)
    for exchange in found:
        for name, written in drafted.commands.items():
            if (values := written.cdb.match(exchange.cdb)) is not None:
                assert true.commands[name].cdb.match(exchange.cdb) is not None, (variant, name)
                assert values.get("length", exchange.asked) == exchange.asked
                true_span, span = (one.commands[name].cdb.fields.get("offset") for one in (true, drafted))
                assert span == true_span
    assert drafted.commands.keys() == true.commands.keys() - {"passive_autofocus", "active_autofocus"}
    assert drafted.blocks.pitch.length == true.blocks.pitch.length
    assert drafted.blocks.parameters.length == true.blocks.parameters.length
    assert {name for name, _ in drafted.pitch.pixel} == {name for name, _ in true.pitch.pixel}
    assert (drafted.pitch.layout, drafted.pitch.fraction_bits) == (true.pitch.layout, true.pitch.fraction_bits)
    strong = {name: getattr(true.blocks, name).checksum for name in ("parameters", "pitch", "colour")}
    for name, checksum in strong.items():
        if checksum and checksum.kind == "crc32":
            assert getattr(drafted.blocks, name).checksum.at == checksum.at


def test_one_operation_code_for_everything_is_split_by_its_second_byte(tmp_path):
    found = exchanges_of(session("one-opcode", SET), tmp_path / "one.pcapng")
    roles = {guess.role: guess.group.exchanges[0].cdb[:2] for guess in guess_roles(found) if guess.role}
    assert {role: cdb[1] for role, cdb in roles.items()} == {
        "read_parameters": 1, "write_parameters": 2, "release": 4, "status": 5, "read_pitch": 6, "read_colour": 7,
    }  # fmt: skip


def test_two_images_of_a_code_without_offsets_are_followed(tmp_path):
    found = exchanges_of(session("type-codes", SET, SET), tmp_path / "two.pcapng")
    pitch, colour = (kind for kind in group(found) if kind.opcode == 0x28)
    assert [sum(piece.moved for piece in block) for block in pitch.blocks] == 2 * [240 * 320 * 9 + 16]
    assert [sum(piece.moved for piece in block) for block in colour.blocks] == 2 * [480 * 640 * 3 + 16]


def test_images_that_are_read_twice_are_two_blocks(tmp_path):
    found = exchanges_of(session("bare", SET), tmp_path / "twice.pcapng")
    (pitch,) = (guess.group for guess in guess_roles(found) if guess.role == "read_pitch")
    assert [sum(piece.moved for piece in block) for block in pitch.blocks] == 2 * [240 * 320 * 9]


def three(variant, name, values, tmp_path):
    settings = {"distance_mm": 900, "laser_power": 68}
    captures = []
    for value in values:
        one = VividSettings(mode="fast", **{**settings, name: value})
        sensor = PlateSensor(distance_mm=one.distance_mm)
        captures.append(exchanges_of(session(variant, one, sensor=sensor), tmp_path / f"{value}.pcapng"))
    return captures


@pytest.mark.slow
@pytest.mark.parametrize("variant", UNLIKE)
@pytest.mark.parametrize(("name", "values"), [("distance_mm", (600, 900, 1200)), ("laser_power", (20, 21, 40))])
def test_the_field_of_a_setting_is_found(variant, name, values, tmp_path):
    captures = three(variant, name, values, tmp_path)
    true = load_profile(f"variants/{variant}").blocks.parameters
    sent = [span for (kind, what), span in find_field(captures, name, values) if what == "sent"]
    assert len(sent) == 1
    for value in values:
        block = true.build({**dict.fromkeys(("gain", "mode", "threshold", "auto_read", "colour"), 0),
                            "distance_mm": 0, "laser_power": 0, name: value})  # fmt: skip
        assert sent[0].read(block, "big") == value


def test_a_field_of_bits_is_found(tmp_path):
    captures = []
    for value in (0, 1, 3):
        one = VividSettings(mode="fast", distance_mm=900, laser_power=68, gain=value)
        captures.append(exchanges_of(session("bit-fields", one), tmp_path / f"{value}.pcapng"))
    lines = list(list_field(captures, "gain", (0, 1, 3)))
    assert any("write_parameters" in line and "{ at = 3, low_bit = 4, bits = 3 }" in line for line in lines)


def test_the_bytes_that_changed_are_named(tmp_path):
    first, second = three("little-endian", "distance_mm", (600, 900), tmp_path)
    lines = list(list_changes(first, second))
    assert any("write_parameters" in line and "bytes 0 to 1: 58 02 → 84 03" in line for line in lines)
    assert list(list_changes(first, first)) == ["no byte of a command or of a block differs"]
    other = exchanges_of(session("type-codes", SET), tmp_path / "other.pcapng")
    assert any("only in the" in line for line in list_changes(first, other))


def test_what_is_not_there_is_not_found(tmp_path):
    captures = three("type-codes", "distance_mm", (600, 900), tmp_path)
    assert find_field(captures, "distance_mm", (601, 902)) == []
    assert "was distance_mm set" in next(iter(list_field(captures, "distance_mm", (601, 902))))
    for values in ((600,), (600, 600), (600, 900, 1200)):
        with pytest.raises(CaptureError, match="one for each capture"):
            find_field(captures, "distance_mm", values)


@pytest.mark.parametrize("value", [b"", b"\x00", b"\x01\x02\x03", bytes(7)])
@pytest.mark.parametrize("code", [2, 8, 9, 14])
def test_damaged_options_are_a_declared_error(code, value, tmp_path):
    """Options of the interface: speed (8), resolution (9) and offset of time (14) have a fixed length."""
    path = write(tmp_path / "options.pcapng", [Said(bytes(6))], options=[(code, value)])
    try:
        assert len(read_exchanges(read_transfers(path))) == 1
    except CaptureError as refused:
        assert "damaged" in str(refused)
        assert refused.hint


def test_a_queue_is_not_a_capture(tmp_path):
    os.mkfifo(tmp_path / "queue.pcapng")
    with pytest.raises(CaptureError, match="not a file"):
        list(read_transfers(tmp_path / "queue.pcapng"))


def test_every_variant_can_be_captured():
    assert {f"{name}.toml" for name in UNLIKE} <= {path.name for path in (PROFILES / "variants").iterdir()}
