"""Blocks of numbers: what is built is parsed back, and what is damaged or of another kind is refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from drivers.scanner import SettingsError
from drivers.vivid900.blocks import Block, Span
from drivers.vivid900.errors import BadReply

SPANS = {"kind": Span(at=0, bytes=1, value=0x2A), "count": Span(at=2, bytes=2), "power": Span(at=5, bytes=3)}
PLAIN = Block(length=10, fields=SPANS)
SUMMED = Block(length=16, fields=SPANS, crc32=12)


@given(count=st.integers(0, 2**16 - 1), power=st.integers(0, 2**24 - 1), order=st.sampled_from(["big", "little"]))
def test_values_come_back_in_either_byte_order(count, power, order):
    block = PLAIN.model_copy(update={"order": order})
    data = block.build({"count": count, "power": power})
    assert data[2:4] == count.to_bytes(2, order)
    assert block.parse(data) == {"kind": 0x2A, "count": count, "power": power}


@given(payload=st.binary(max_size=20), at=st.integers(0), bit=st.integers(0, 7))
def test_the_checksum_finds_every_single_wrong_bit(payload, at, bit):
    data = bytearray(SUMMED.build({"count": 1, "power": 2}, payload))
    assert SUMMED.parse(bytes(data), payload=len(payload))["power"] == 2
    data[at % len(data)] ^= 1 << bit
    with pytest.raises(BadReply, match="checksum"):
        SUMMED.parse(bytes(data), payload=len(payload))


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


@pytest.mark.parametrize(
    "block",
    [
        {"length": 4, "fields": {"late": {"at": 3, "bytes": 2}}},
        {"length": 4, "fields": {"a": {"at": 0, "bytes": 2}, "b": {"at": 1, "bytes": 1}}},
        {"length": 4, "fields": {"a": {"at": 0, "bytes": 1}}, "crc32": 0},
        {"length": 4, "fields": {"a": {"at": 0, "bytes": 1, "value": 256}}},
    ],
)
def test_a_description_that_contradicts_itself_is_refused(block):
    with pytest.raises(ValidationError):
        Block.model_validate(block)
