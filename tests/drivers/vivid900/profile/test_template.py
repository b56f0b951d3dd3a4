"""Templates: what is built is parsed back, and what is damaged or of another kind is refused."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pydantic import ValidationError

from drivers.scanner import SettingsError
from drivers.scsi.errors import BadReply
from drivers.vivid900.profile.template import CHECKSUMS, Checksum, Span, Template

SPANS = {"kind": Span(at=0, value=0x2A), "count": Span(at=2, bytes=2), "power": Span(at=5, bytes=3)}
PLAIN = Template(length=10, fields=SPANS)
SUMMED = Template(length=16, fields=SPANS, checksum=Checksum(kind="crc32", at=12))


@given(count=st.integers(0, 2**16 - 1), power=st.integers(0, 2**24 - 1), order=st.sampled_from(["big", "little"]))
def test_values_come_back_in_either_byte_order(count, power, order):
    block = PLAIN.model_copy(update={"order": order})
    data = block.build({"count": count, "power": power})
    assert data[2:4] == count.to_bytes(2, order)
    assert block.parse(data) == {"kind": 0x2A, "count": count, "power": power}


@given(
    payload=st.binary(max_size=20), at=st.integers(0), bit=st.integers(0, 7), kind=st.sampled_from(sorted(CHECKSUMS))
)
def test_a_checksum_finds_every_single_wrong_bit(payload, at, bit, kind):
    block = SUMMED.model_copy(update={"checksum": Checksum(kind=kind, at=12)})
    data = bytearray(block.build({"count": 1, "power": 2}, payload))
    assert block.parse(bytes(data), payload=len(payload))["power"] == 2
    data[at % len(data)] ^= 1 << bit
    with pytest.raises(BadReply, match="checksum"):
        block.parse(bytes(data), payload=len(payload))


@pytest.mark.parametrize(
    ("kind", "checksum"),
    # "123456789": the check values of Ross Williams' catalogue of CRCs, and sums by hand: 9 digits from 31h to 39h.
    [("crc32", 0xCBF43926), ("crc16", 0x29B1), ("sum16", 0x01DD), ("sum8", 0xDD), ("xor8", 0x31)],
)
def test_checksums_of_a_known_text(kind, checksum):
    assert CHECKSUMS[kind][1](b"123456789") == checksum
    assert SUMMED.is_checked
    assert not SUMMED.model_copy(update={"checksum": Checksum(kind="sum16", at=12)}).is_checked


@pytest.mark.parametrize("data", [b"", bytes(9), bytes(11)])
def test_a_block_of_another_length_is_refused(data):
    with pytest.raises(BadReply, match="bytes came"):
        PLAIN.parse(data)


def test_a_block_of_another_kind_is_refused_by_its_fixed_value():
    with pytest.raises(BadReply, match="kind"):
        PLAIN.parse(bytes(10))


@pytest.mark.parametrize("values", [{"count": 1}, {"count": 2**16, "power": 0}, {"count": -1, "power": 0}])
def test_a_value_that_is_missing_or_does_not_fit_is_refused(values):
    with pytest.raises(SettingsError, match="does not fit"):
        PLAIN.build(values)


def test_a_block_is_changed_in_the_given_values_alone():
    base = bytes(range(0x2A, 0x34))
    changed = PLAIN.build({"count": 0xAABB}, base=base)
    assert changed == base[:2] + b"\xaa\xbb" + base[4:]
    with pytest.raises(SettingsError, match="cannot be changed"):
        PLAIN.build({}, base=base[1:])


def test_bits_share_a_byte_and_leave_the_others():
    flags = {"gain": Span(at=1, low_bit=4, bits=3), "mode": Span(at=1, bits=3)}
    block = Template(length=3, fields=flags)
    data = block.build({"gain": 5, "mode": 2}, base=b"\xff\xff\xff")
    assert data == bytes([0xFF, 0b1101_1010, 0xFF])
    assert block.parse(data) == {"gain": 5, "mode": 2}
    with pytest.raises(SettingsError, match="3 bits"):
        block.build({"gain": 8, "mode": 0})


@given(st.integers(0, 2**16 - 1), st.sampled_from([1, 3, 10, 256]))
def test_a_scaled_number_is_rounded_to_its_unit(wire, scale):
    span = Span(at=0, bytes=2, scale=scale)
    value = span.read(wire.to_bytes(2, "big"), "big")
    assert abs(wire / scale - value) <= 0.5
    if span.holds(value):
        data = bytearray(2)
        span.write(data, value, "big")
        assert int.from_bytes(data, "big") == value * scale


@pytest.mark.parametrize(
    "block",
    [
        {"length": 4, "fields": {"late": {"at": 3, "bytes": 2}}},
        {"length": 4, "fields": {"a": {"at": 0, "bytes": 2}, "b": {"at": 1}}},
        {"length": 4, "fields": {"a": {"at": 0}}, "checksum": {"kind": "crc32", "at": 0}},
        {"length": 4, "fields": {"a": {"at": 0, "value": 256}}},
        {"length": 4, "fields": {"a": {"at": 0, "low_bit": 6, "bits": 3}}},
        {"length": 4, "fields": {"a": {"at": 0, "bits": 4}, "b": {"at": 0, "low_bit": 3}}},
        "C0 length/2 length/2",
        "C0 length/10",
        "0",
        "C0 00|kind:0-2",
    ],
)
def test_a_description_that_contradicts_itself_is_refused(block):
    with pytest.raises(ValidationError):
        Template.model_validate(block)


FIELD = st.tuples(st.sampled_from(["offset", "length", "kind"]), st.integers(1, 4), st.booleans())


@given(st.binary(min_size=6, max_size=8), st.lists(FIELD, unique_by=lambda field: field[0]), st.data())
def test_text_is_read_and_built_back(fixed, fields, data):
    words = [f"{byte:02X}" for byte in fixed] + [f"{name}/{size}{'<' * little}" for name, size, little in fields]
    template = Template.model_validate(" ".join(words))
    values = {name: data.draw(st.integers(0, (1 << 8 * size) - 1)) for name, size, _ in fields}
    order = {True: "little", False: "big"}
    built = template.build(values)
    assert built == fixed + b"".join(values[name].to_bytes(size, order[little]) for name, size, little in fields)
    assert template.match(built) == values
    assert template.match(bytes([built[0] ^ 1]) + built[1:]) is None
    assert template.overlaps(template)


@given(st.integers(0, 7), st.integers(0, 7))
def test_bits_of_a_text(kind, other):
    assume(kind != other)
    template, twin = (Template.model_validate(f"C6 {byte:02X}|kind:2-0 00") for byte in (kind << 4, other << 4))
    assert template.build({"kind": 5}) == bytes([0xC6, kind << 4 | 5, 0])
    assert twin.match(template.build({"kind": 5})) is None
    assert not template.overlaps(twin)
    assert template.overlaps(Template.model_validate("C6 which/1 00"))


@pytest.mark.parametrize("place", [4097, 2**40, 2**63 - 1])
def test_a_place_far_beyond_every_block_takes_no_memory(place):
    for table in ({"fields": {"a": {"at": place}}}, {"checksum": {"kind": "sum8", "at": place}}):
        with pytest.raises(ValidationError, match="less than or equal to 4096"):
            Template.model_validate({"length": 4, **table})
