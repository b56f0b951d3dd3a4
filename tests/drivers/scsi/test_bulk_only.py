"""The Bulk-Only wrappers: golden bytes, round trips, and any bytes at all."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.scanner import SettingsError, TransportError
from drivers.scsi.bulk_only import (
    CommandWrapper,
    StatusWrapper,
    build_command,
    build_status,
    parse_command,
    parse_status,
)

WORD = st.integers(0, 0xFFFFFFFF)
BYTE = st.integers(0, 0xFF)
COMMANDS = st.builds(CommandWrapper, WORD, WORD, st.booleans(), BYTE, st.binary(min_size=1, max_size=16))
STATUSES = st.builds(StatusWrapper, WORD, WORD, BYTE)


def test_a_command_as_the_kernels_documentation_prints_one():
    """Documentation/usb/usbmon.rst: a READ(10) for a storage device, tag ad, 32 KiB in."""
    printed = "55534243 ad000000 00800000 80010a28 20000000 20000040 00000000 000000"
    data = bytes.fromhex(printed)
    wrapper = CommandWrapper(0xAD, 0x8000, True, 1, bytes.fromhex("28 20 00000020 00 0040 00"))
    assert parse_command(data) == wrapper
    assert build_command(wrapper) == data


def test_a_status_byte_for_byte():
    wrapper = StatusWrapper(0xAD, 0x0102, 1)
    assert build_status(wrapper) == b"USBS" + bytes.fromhex("ad000000 02010000 01")


@given(COMMANDS)
def test_commands_survive(wrapper):
    assert parse_command(build_command(wrapper)) == wrapper


@given(STATUSES)
def test_statuses_survive(wrapper):
    assert parse_status(build_status(wrapper)) == wrapper


@given(st.one_of(st.binary(max_size=64), st.binary(min_size=27, max_size=27).map(lambda rest: b"USBC" + rest)))
def test_any_bytes_are_a_command_or_the_declared_error(data):
    try:
        wrapper = parse_command(data)
    except TransportError:
        return
    assert 1 <= len(wrapper.cdb) <= 16


@given(st.one_of(st.binary(max_size=32), st.binary(min_size=9, max_size=9).map(lambda rest: b"USBS" + rest)))
def test_any_bytes_are_a_status_or_the_declared_error(data):
    try:
        assert build_status(parse_status(data)) == data
    except TransportError:
        assert len(data) != 13 or data[:4] != b"USBS"


@pytest.mark.parametrize("cdb", (b"", bytes(17)))
def test_a_command_block_that_does_not_fit_is_refused(cdb):
    with pytest.raises(SettingsError):
        build_command(CommandWrapper(1, 0, False, 0, cdb))
