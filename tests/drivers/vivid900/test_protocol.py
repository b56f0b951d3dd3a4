"""Every command and block, built and parsed: what was built is read back, and no bytes get past the declared errors."""

from __future__ import annotations

import random
import tracemalloc
from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.scanner import ScannerError, SettingsError, TransportError
from drivers.scsi import commands as scsi
from drivers.scsi import framing
from drivers.scsi import sense as sensing
from drivers.scsi.commands import Identity
from drivers.scsi.errors import BadReply
from drivers.scsi.sense import Key, Sense
from drivers.scsi.transport import Reply
from drivers.vivid900.capture import colour, pitch
from drivers.vivid900.capture.colour import ColourImage
from drivers.vivid900.capture.pitch import Sums
from drivers.vivid900.faults import error_of
from drivers.vivid900.geometry.lenses import FAST, FINE, Mode
from drivers.vivid900.profile import commands
from drivers.vivid900.profile.commands import AUTO_THRESHOLD, RANGES, Parameters, ShotMode, Status
from drivers.vivid900.profile.profile import SIMULATED, load_profile
from tests.drivers.vivid900.mutations import mutated

PROFILE = load_profile(SIMULATED)
TINY = Mode("tiny", rows=3, cols=4, step=1, block_lines=5, seconds=0.0)
FEW, MANY = 1000, 100_000
WATCHED = 10_000  # of those, with an eye on memory: each takes four times as long
# Beyond what a parser makes of its input; what mutated lengths of 32 bits would ask for is a thousand times as much.
MAX_MEMORY = 4 << 20

BYTE = st.integers(0, 255)
TEXT = st.text(st.characters(min_codepoint=0x21, max_codepoint=0x7E), max_size=4)
SENSES = st.builds(Sense, st.sampled_from(Key), BYTE, BYTE, st.booleans())
PARAMETERS = st.builds(
    Parameters,
    **{name: st.integers(*limits) for name, limits in RANGES.items() if name not in ("mode", "threshold")},
    mode=st.sampled_from(ShotMode),
    threshold=st.integers(0, 1023) | st.just(AUTO_THRESHOLD),
)
U32 = st.integers(0, 2**32 - 1)
STATUSES = st.builds(
    Status,
    state=st.sampled_from(sorted(PROFILE.states)),
    lens=st.sampled_from(sorted(PROFILE.lenses)),
    panel=st.sampled_from(["", *PROFILE.panels]),
    lens_serial=U32,
    body_serial=U32,
    shot=U32,
    focused=U32,
)
IDENTITIES = st.builds(Identity, st.integers(0, 31), TEXT, TEXT, TEXT, st.integers(0, 7), st.booleans())


def sums(rng: np.random.Generator, mode: Mode) -> Sums:
    total = rng.integers(0, 4000, (mode.rows, mode.cols)).astype(np.uint32)
    frames = rng.integers(0, mode.rows + mode.frames, total.shape)
    intensity = rng.integers(0, 256, total.shape).astype(np.uint8)
    return Sums(total, (total * frames).astype(np.uint32), intensity)


PARSERS: dict[str, tuple[bytes, Callable[[bytes], object]]] = {
    "identity": (Identity(6, "PLANISH", "SIM VIVID 900", "0.9").build(), scsi.parse_identity),
    "sense": (Sense(Key.NOT_READY, 4, 1).build(), sensing.parse_sense),
    "parameters": (
        commands.build_parameters(PROFILE, Parameters()),
        lambda data: commands.parse_parameters(PROFILE, data),
    ),
    "status": (
        commands.build_status(PROFILE, Status("ready", "TELE")),
        lambda data: commands.parse_status(PROFILE, data),
    ),
    "command": (
        commands.read_pitch(PROFILE, 0, 4096).cdb,
        lambda data: commands.parse_command(PROFILE, data),
    ),
    "pitch": (
        pitch.build_pitch(PROFILE, sums(np.random.default_rng(1), TINY), 7),
        lambda data: pitch.parse_pitch(PROFILE, TINY, data),
    ),
    "request": (
        framing.build_request(framing.Request(bytes(6), b"abc"))[4:],
        framing.parse_request,
    ),
    "reply": (framing.build_reply(Reply(2, b"", Sense(Key.ABORTED_COMMAND).build()))[4:], framing.parse_reply),
    "frame": (framing.PREFIX.pack(77), lambda data: framing.frame_length((data + bytes(4))[:4])),
}
"""Name → bytes that are right, and the parser for them."""


def unchecked(name: str) -> Callable[[bytes], object]:
    """The parser for a profile whose blocks have no checksum: mutations get as far as the fields."""
    blocks = PROFILE.blocks
    open_blocks = {
        block: getattr(blocks, block).model_copy(update={"checksum": None}) for block in type(blocks).model_fields
    }
    profile = PROFILE.model_copy(update={"blocks": blocks.model_copy(update=open_blocks)})
    parsers: dict[str, Callable[[bytes], object]] = {
        "parameters": lambda data: commands.parse_parameters(profile, data),
        "status": lambda data: commands.parse_status(profile, data),
        "pitch": lambda data: pitch.parse_pitch(profile, TINY, data),
    }
    return parsers[name]


@given(IDENTITIES)
def test_inquiry_data(identity: Identity) -> None:
    assert scsi.parse_identity(identity.build()) == identity


def test_inquiry_data_as_a_scanner_sends_it() -> None:
    # Peripheral type 06h, SCSI-2, format 2: the head of a reply that the SANE project documents.
    data = bytes.fromhex("06 00 02 02 5b 00 00 00") + b"MINOLTA VIVID 900       1.00" + bytes(60)
    assert scsi.parse_identity(data) == Identity(6, "MINOLTA", "VIVID 900", "1.00")


@pytest.mark.parametrize(
    ("build", "cdb"),
    [
        (scsi.test_unit_ready, "00 00 00 00 00 00"),
        (scsi.inquiry, "12 00 00 00 24 00"),
        (lambda: scsi.request_sense(18), "03 00 00 00 12 00"),
    ],
)
def test_standard_commands_to_the_byte(build: Callable[[], bytes], cdb: str) -> None:
    assert build() == bytes.fromhex(cdb)


@pytest.mark.parametrize("length", [-1, 256])
def test_no_allocation_that_a_cdb_cannot_say(length: int) -> None:
    with pytest.raises(SettingsError):
        scsi.inquiry(length)


@given(SENSES)
def test_sense_data(sense: Sense) -> None:
    assert sensing.parse_sense(sense.build()) == sense
    error = error_of(sense, PROFILE.panel_by_sense)
    assert isinstance(error, ScannerError)
    assert error.hint


def test_sense_data_in_descriptor_format() -> None:
    assert sensing.parse_sense(bytes.fromhex("72 05 24 00 00 00 00 00")) == Sense(Key.ILLEGAL_REQUEST, 0x24)


def test_sense_data_that_was_cut_off_has_its_key() -> None:
    whole = Sense(Key.HARDWARE_ERROR, 0x44, 1).build()
    assert sensing.parse_sense(whole[:8]) == Sense(Key.HARDWARE_ERROR)
    beyond = whole[:7] + b"\x04" + whole[8:]  # four bytes follow: the code is not among them
    assert sensing.parse_sense(beyond) == Sense(Key.HARDWARE_ERROR)


@given(PARAMETERS)
def test_parameters(parameters: Parameters) -> None:
    command = commands.write_parameters(PROFILE, commands.build_parameters(PROFILE, parameters))
    assert commands.parse_parameters(PROFILE, command.data_out) == parameters


@pytest.mark.parametrize("name", sorted(RANGES))
@pytest.mark.parametrize("side", [0, 1])
def test_a_parameter_out_of_its_range_is_refused(name: str, side: int) -> None:
    limit, beyond = RANGES[name][side], RANGES[name][side] + (-1, 1)[side]
    Parameters(**{name: limit})
    with pytest.raises(SettingsError, match=name):
        Parameters(**{name: beyond})


@given(STATUSES)
def test_status(status: Status) -> None:
    assert commands.parse_status(PROFILE, commands.build_status(PROFILE, status)) == status


@given(st.sampled_from(ShotMode), U32, st.integers(0, 2**24 - 1))
def test_every_command_is_read_back(mode: ShotMode, offset: int, length: int) -> None:
    built = [
        commands.read_parameters(PROFILE),
        commands.status(PROFILE),
        commands.write_parameters(PROFILE, commands.build_parameters(PROFILE, Parameters())),
        commands.autofocus(PROFILE, "passive"),
        commands.autofocus(PROFILE, "active"),
        commands.release(PROFILE, Parameters()),
        commands.read_pitch(PROFILE, offset, length),
        commands.read_colour(PROFILE, mode, offset, length),
    ]
    for command in built:
        assert commands.parse_command(PROFILE, command.cdb) == (command.name, dict(command.values))


def test_a_length_that_no_cdb_can_say_is_refused() -> None:
    with pytest.raises(SettingsError, match="length"):
        commands.read_pitch(PROFILE, 0, 2**24)


@given(st.integers(0, 2**32 - 1), st.integers(0, 1000))
def test_pitch(seed: int, shot: int) -> None:
    original = sums(np.random.default_rng(seed), TINY)
    back = pitch.parse_pitch(PROFILE, TINY, pitch.build_pitch(PROFILE, original, shot))
    assert back.shot == shot
    np.testing.assert_array_equal(back.intensity, original.intensity)
    seen = original.sum > 0
    np.testing.assert_array_equal(np.isfinite(back.frames), seen)
    exact = (original.moment / np.maximum(original.sum, 1))[seen]
    assert np.abs(back.frames[seen] - exact).max(initial=0) <= 0.5 / pitch.FRACTION


@pytest.mark.parametrize("mode", [FINE, FAST])
def test_data_of_a_shot_are_as_many_as_the_manual_says(mode: Mode) -> None:
    # p. 59: 3.6 and 1.6 MB, colour included; to the two digits given, a megabyte of 1,024,000 bytes.
    size = pitch.pitch_length(PROFILE, mode) + colour.colour_length(PROFILE, ShotMode.FINE_COLOUR)
    assert round(size / 1_024_000, 1) == {FINE: 3.6, FAST: 1.6}[mode]


@pytest.mark.parametrize("mode", list(ShotMode))
@pytest.mark.parametrize("layout", ["interleaved", "planar"])
@pytest.mark.parametrize("channels", ["RGB", "BGR", "GBR"])
def test_colour(mode: ShotMode, layout: str, channels: str) -> None:
    encoding = PROFILE.colour.model_copy(update={"layout": layout, "channels": channels})
    profile = PROFILE.model_copy(update={"colour": encoding})
    deep = mode is ShotMode.COLOUR_10
    shape = (480, 640, len(colour.channels_of(mode)))
    pixels = np.random.default_rng(3).integers(0, 1024 if deep else 256, shape).astype(np.uint16 if deep else np.uint8)
    data = colour.build_colour(profile, mode, ColourImage(pixels, 9))
    assert len(data) == colour.colour_length(profile, mode)
    back = colour.parse_colour(profile, mode, data)
    np.testing.assert_array_equal(back.pixels, pixels)
    assert back.pixels.dtype == pixels.dtype
    assert back.shot == 9


def test_an_image_of_another_mode_or_another_block_is_refused() -> None:
    fast = pitch.build_pitch(PROFILE, sums(np.random.default_rng(2), FAST), 1)
    with pytest.raises(BadReply):
        pitch.parse_pitch(PROFILE, FINE, fast)
    image = np.zeros((480, 640, 3), np.uint8)
    data = colour.build_colour(PROFILE, ShotMode.COLOUR_8, ColourImage(image))
    with pytest.raises(BadReply):
        colour.parse_colour(PROFILE, ShotMode.MONITOR, data)
    with pytest.raises(BadReply, match="checksum"):
        colour.parse_colour(PROFILE, ShotMode.COLOUR_8, data[:-1] + b"\x01")


def test_a_barycentre_outside_the_sweep_counts_as_not_seen() -> None:
    one = np.ones((3, 4), np.uint32)
    parsed = pitch.parse_pitch(PROFILE, TINY, pitch.build_pitch(PROFILE, Sums(one, one * 9, one.astype(np.uint8)), 1))
    assert np.isnan(parsed.frames).all()  # three rows and a block of five: there is no ninth frame


@given(st.binary(max_size=64))
@settings(max_examples=300)
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    for _, parse in PARSERS.values():
        refused_or_read(parse, data)


@pytest.mark.parametrize("name", PARSERS)
def test_mutated_bytes_are_read_or_refused(name: str) -> None:
    assert sum(outcomes(*PARSERS[name], FEW).values()) == FEW


@pytest.mark.slow
@pytest.mark.parametrize("name", PARSERS)
def test_a_hundred_thousand_mutated_replies(name: str) -> None:
    tracemalloc.start()
    try:
        watched = outcomes(*PARSERS[name], WATCHED)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < MAX_MEMORY
    others = outcomes(*PARSERS[name], MANY - WATCHED)
    assert sum(watched.values()) + sum(others.values()) == MANY


@pytest.mark.slow
@pytest.mark.parametrize("name", ["parameters", "status", "pitch"])
def test_a_hundred_thousand_mutated_replies_without_checksums(name: str) -> None:
    counts = outcomes(PARSERS[name][0], unchecked(name), MANY)
    assert sum(counts.values()) == MANY
    assert counts["read"] > MANY / 100  # many are as good as right: the fields themselves are tried


def outcomes(data: bytes, parse: Callable[[bytes], object], number: int) -> dict[str, int]:
    rng, counts = random.Random(number), {"read": 0, "refused": 0}
    for _ in range(number):
        counts[refused_or_read(parse, mutated(data, rng))] += 1
    return counts


def refused_or_read(parse: Callable[[bytes], object], data: bytes) -> str:
    try:
        parse(data)
    except TransportError:  # BadReply among them
        return "refused"
    return "read"


def test_every_parameter_has_a_range() -> None:
    assert {item.name for item in fields(Parameters)} == set(RANGES)
