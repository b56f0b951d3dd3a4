"""From a capture to commands, groups and a draft, on what the real driver said to the simulated scanner."""

from __future__ import annotations

import io
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.scanner import SettingsError
from drivers.scsi.bulk_only import CommandWrapper, StatusWrapper, build_command, build_status
from drivers.scsi.sense import Key, Sense
from drivers.trace import CaptureError
from drivers.trace.capture import read_transfers
from drivers.trace.draft import draft_profile
from drivers.trace.exchanges import HEAD_LENGTH, Exchange, read_exchanges
from drivers.trace.groups import group
from drivers.trace.listing import as_data, list_exchanges
from drivers.trace.packets import Transfer
from drivers.trace.roles import guess_roles
from drivers.vivid900.profile.commands import parse_command
from drivers.vivid900.profile.profile import PROFILES, SIMULATED, parse_profile
from drivers.vivid900.profile.template import Template
from drivers.vivid900.settings import VividSettings
from oracles.simulation.buses.capture import RECORDS, Urb, write_capture
from oracles.simulation.buses.usb_descriptors import BULK_IN, BULK_OUT

WHERE, ELSEWHERE = (1, 5), (1, 9)


@pytest.fixture(scope="module")
def exchanges(captured) -> list[Exchange]:
    return read_exchanges(read_transfers(captured()))


def said(wrapper: CommandWrapper, data: list[bytes], status: StatusWrapper | None, where=WHERE) -> list[Transfer]:
    """The transfers of one command, its data in pieces."""
    parts = [(False, build_command(wrapper)), *((wrapper.from_device, piece) for piece in data)]
    parts += [(True, build_status(status))] if status else []
    return [Transfer(where, inward, part, len(part)) for inward, part in parts]


def reading(tag: int, data: list[bytes], *, status: int = 0, asked: int | None = None, where=WHERE) -> list[Transfer]:
    moved = sum(map(len, data))
    length = moved if asked is None else asked
    wrapper = CommandWrapper(tag, length, True, 0x50, bytes([0xC4] + 9 * [0]))
    return said(wrapper, data, StatusWrapper(tag, length - moved, status), where)


def test_every_command_of_the_driver_is_found(exchanges, urbs):
    wrappers = [urb.data for urb in urbs if urb.endpoint == BULK_OUT and urb.data[:4] == b"USBC"]
    assert [exchange.cdb for exchange in exchanges] == [data[15 : 15 + data[14]] for data in wrappers]
    assert {exchange.lun for exchange in exchanges} == {0x50}  # SCSI ID 5 behind a Microtech


@pytest.mark.parametrize("link_type", sorted(RECORDS))
def test_it_does_not_matter_who_captured(captured, exchanges, link_type):
    assert read_exchanges(read_transfers(captured(link_type))) == exchanges


def test_sense_data_stands_with_the_command_that_failed(exchanges):
    failed = [exchange for exchange in exchanges if exchange.outcome == "failed"]
    assert [exchange.sense for exchange in failed] == [Sense(Key.UNIT_ATTENTION, 0x29).build()]  # power-on


def test_kinds_of_commands_and_their_fields(exchanges, profile):
    for kind in group(exchanges):
        known = parse_command(profile, kind.exchanges[0].cdb)
        if not known or known[0] not in ("read_pitch", "read_colour"):
            assert kind.offset is None
            continue
        spans = profile.commands[known[0]].cdb.fields
        assert kind.length == (spans["length"].at, spans["length"].bytes, "big")
        assert kind.offset == (spans["offset"].at, spans["offset"].bytes, "big")


def test_every_role_that_was_played_is_guessed_right(exchanges, profile):
    for guess in guess_roles(exchanges):
        name, _ = parse_command(profile, guess.group.exchanges[0].cdb)
        assert guess.role == (None if name.endswith("autofocus") else name)


def test_the_draft_builds_every_command_that_was_seen(exchanges):
    drafted = {
        name: Template.model_validate(text)
        for name, text in tomllib.loads(draft_profile(exchanges, name="x"))["commands"].items()
    }
    assert set(drafted) == {
        "read_parameters", "write_parameters", "release", "status", "read_pitch", "read_colour",
    }  # fmt: skip
    vendors = [exchange for exchange in exchanges if exchange.cdb[0] >= 0xC0 and exchange.cdb[0] != 0xC2]
    for exchange in vendors:
        (values,) = (values for layout in drafted.values() if (values := layout.match(exchange.cdb)) is not None)
        assert values.get("length", exchange.asked) == exchange.asked


def test_a_draft_that_was_completed_drives_the_scanner(exchanges, profile, scan_with):
    """The operator finds out the rest; here it is known. Byte for byte the same scan as with the true profile."""
    known = tomllib.loads((PROFILES / f"{SIMULATED}.toml").read_text("utf-8"))
    drafted = tomllib.loads(draft_profile(exchanges, name="x"))
    completed = {**known, **{key: drafted[key] for key in ("name", "about", "chunk_bytes", "firmware")}}
    completed["commands"] = {**known["commands"], **drafted["commands"]}
    mine = scan_with(parse_profile(completed), VividSettings(mode="fast"))
    theirs = scan_with(profile, VividSettings(mode="fast"))
    assert np.array_equal(mine.points, theirs.points, equal_nan=True)
    assert np.array_equal(mine.texture, theirs.texture)


def test_a_draft_as_it_is_may_only_ask(exchanges):
    draft = parse_profile(tomllib.loads(draft_profile(exchanges, name="x")))
    assert not draft.trusted
    assert draft.lacking
    with pytest.raises(SettingsError, match="needs"):
        parse_profile({**tomllib.loads(draft_profile(exchanges, name="x")), "trusted": True})


@pytest.mark.parametrize("name", ['quo"ted', "back\\slash", "new\nline", "ümlaut", "\x07", "😀"])
def test_a_draft_is_toml_whatever_its_name(exchanges, name):
    assert tomllib.loads(draft_profile(exchanges, name=name))["name"] == name


def test_blocks_in_pieces_are_put_together():
    """Virtual machines cut transfers."""
    data = bytes(range(200))
    (found,) = read_exchanges(reading(1, [data[:64], data[64:128], data[128:]]))
    assert (found.asked, found.moved, found.head) == (200, 200, data[:HEAD_LENGTH])


def test_a_residue_is_not_counted_as_data():
    wrapper = CommandWrapper(1, 100, True, 0, bytes(6))
    (found,) = read_exchanges(said(wrapper, [bytes(100)], StatusWrapper(1, 60, 0)))
    assert (found.moved, found.head) == (40, bytes(40))


def test_two_bridges_at_once_are_kept_apart():
    mine, theirs = reading(1, [b"mine"]), reading(1, [b"theirs"], where=ELSEWHERE)
    mixed = [transfer for pair in zip(mine, theirs, strict=True) for transfer in pair]
    assert {(e.where, e.head) for e in read_exchanges(mixed)} == {(WHERE, b"mine"), (ELSEWHERE, b"theirs")}


def test_data_that_looks_like_a_command_is_data():
    inner = build_command(CommandWrapper(9, 0, False, 0, bytes(6)))
    outer = CommandWrapper(1, len(inner), False, 0, bytes([0xC1] + 9 * [0]))
    (found,) = read_exchanges(said(outer, [inner], StatusWrapper(1, 0, 0)))
    assert (found.cdb[0], found.head) == (0xC1, inner)


def test_data_that_looks_like_another_commands_status_is_data():
    inner = build_status(StatusWrapper(7, 0, 0))
    (found,) = read_exchanges(reading(1, [inner]))
    assert found.head == inner


def test_commands_without_an_end_are_reported_as_such():
    cut = reading(1, [b"data"])[:-1]
    found = read_exchanges([*cut, *reading(2, [b"more"]), *reading(3, [b"last"])[:1]])
    assert [exchange.outcome for exchange in found] == ["unanswered", "good", "unanswered"]


def test_sense_data_of_another_unit_is_not_taken():
    failed = reading(1, [], status=1, asked=24)
    other = CommandWrapper(2, 18, True, 0x10, bytes([0x03, 0, 0, 0, 18, 0]))
    found = read_exchanges([*failed, *said(other, [bytes(18)], StatusWrapper(2, 0, 0))])
    assert found[0].sense == b""


def test_the_listing_names_every_command(exchanges):
    lines = list(list_exchanges(exchanges))
    assert len(lines) == len(exchanges) + 1 + len(group(exchanges))
    assert "UNIT ATTENTION 29h/00h" in lines[1]
    data = as_data(exchanges)
    assert [command["cdb"] for command in data["commands"]] == [exchange.cdb.hex() for exchange in exchanges]
    assert sorted(n for kind in data["groups"] for n in kind["commands"]) == [*range(len(exchanges))]


def test_a_capture_without_commands_says_so(tmp_path):
    path = tmp_path / "none.pcapng"
    with path.open("wb") as file:
        write_capture(file, [Urb(BULK_IN, b"something else", 64)])
    with pytest.raises(CaptureError, match="no SCSI commands"):
        read_exchanges(read_transfers(path))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty"),
        (b"not a capture at all", "not a pcapng"),
        (bytes.fromhex("d4c3b2a1") + bytes(20), "old kind"),
        (bytes.fromhex("0a0d0d0a"), "damaged|no USB"),
    ],
)
def test_files_that_are_not_captures(tmp_path, content, message):
    path = tmp_path / "file.pcapng"
    path.write_bytes(content)
    with pytest.raises(CaptureError, match=message) as caught:
        list(read_transfers(path))
    assert caught.value.hint
    assert caught.value.exit_code == 3


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(CaptureError, match=r"nothing\.pcapng"):
        list(read_transfers(tmp_path / "nothing.pcapng"))


def test_a_capture_of_something_else_says_what_it_holds(tmp_path, captured):
    path = tmp_path / "ethernet.pcapng"
    content = captured().read_bytes()
    assert content[36:38] == (220).to_bytes(2, "little")  # the link type of the interface block
    path.write_bytes(content[:36] + (1).to_bytes(2, "little") + content[38:])
    with pytest.raises(CaptureError, match="link types 1"):
        list(read_transfers(path))


@pytest.fixture(scope="module")
def small_capture() -> bytes:
    file = io.BytesIO()
    urbs = [Urb(BULK_OUT, build_command(CommandWrapper(1, 8, True, 0, bytes(6))), 31), Urb(BULK_IN, b"8 bytes!", 8)]
    write_capture(file, [*urbs, Urb(BULK_IN, build_status(StatusWrapper(1, 0, 0)), 13)])
    return file.getvalue()


@pytest.fixture(scope="module")
def scratch(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("damaged") / "capture.pcapng"


def read_damaged(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    try:
        exchanges = read_exchanges(read_transfers(path))
    except CaptureError:
        return
    tomllib.loads(draft_profile(exchanges, name="x"))
    list(list_exchanges(exchanges))


def test_a_capture_cut_anywhere_is_read_or_declared_damaged(small_capture, scratch):
    for length in range(0, len(small_capture), 3):
        read_damaged(scratch, small_capture[:length])


FUZZ = settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


@FUZZ
@given(data=st.data())
def test_a_damaged_capture_is_read_or_declared_damaged(small_capture, scratch, data):
    content = bytearray(small_capture)
    for _ in range(data.draw(st.integers(1, 6))):
        place = data.draw(st.integers(0, len(content) - 1))
        content[place] = data.draw(st.sampled_from([0, 1, 0x7F, 0x80, 0xFF, content[place] ^ 0x10]))
    read_damaged(scratch, bytes(content))


def test_a_length_that_a_file_only_claims_costs_nothing(small_capture, scratch):
    """A block that claims 4 GB in a file of a few hundred bytes."""
    start = small_capture.index(b"\x06\x00\x00\x00", 40)
    read_damaged(scratch, small_capture[: start + 4] + b"\xfc\xff\xff\xff" + small_capture[start + 8 :])
