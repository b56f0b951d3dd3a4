"""USB transfers out of capture records: the kernel's own example, both headers of usbmon, USBPcap's, and any bytes."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.trace import CaptureError
from drivers.trace.packets import READERS, Transfer, usbmon_transfer, usbpcap_transfer

# Documentation/usb/usbmon.rst prints this write of a READ(10) to a storage device as
# "dd65f0e8 4128379752 S Bo:1:005:2 -115 31 = 55534243 …"; here are the fields as its binary form has them.
WRAPPER = bytes.fromhex("55534243 ad000000 00800000 80010a28 20000000 20000040 00000000 000000")


def usbmon(order="<", *, event=b"S", kind=3, endpoint=0x02, status=-115, length=31, data=WRAPPER, padding=16) -> bytes:
    head = struct.pack(
        order + "QcBBBHBBqiiII",
        0xDD65F0E8, event, kind, endpoint, 5, 1, 0x2D, 0, 4128, 379752, status, length, len(data),
    )  # fmt: skip
    assert len(head) == 40
    return head + bytes(8 + padding) + data


def usbpcap(*, info=0, endpoint=0x02, kind=3, status=0, data=WRAPPER, extra=0) -> bytes:
    head = struct.pack("<HQIHBHHBBI", 27 + extra, 1, status, 9, info, 1, 5, endpoint, kind, len(data))
    assert len(head) == 27
    return head + bytes(extra) + data


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize(("header", "padding"), [(64, 16), (48, 0)])
def test_the_kernels_example(order, header, padding):
    found = usbmon_transfer(usbmon(order, padding=padding), header=header, order=order)
    assert found == Transfer((1, 5), False, WRAPPER, 31)


def test_data_from_the_device_comes_with_the_completion():
    asked = usbmon(event=b"S", endpoint=0x81, data=b"", length=13)
    came = usbmon(event=b"C", endpoint=0x81, status=0, data=b"USBS", length=4)
    assert usbmon_transfer(asked, header=64, order="<") is None
    assert usbmon_transfer(came, header=64, order="<") == Transfer((1, 5), True, b"USBS", 4)


def test_a_capture_that_kept_only_the_beginning_still_shows_the_length():
    cut = usbmon(event=b"C", endpoint=0x81, status=0, data=b"head", length=32768)
    assert usbmon_transfer(cut, header=64, order="<") == Transfer((1, 5), True, b"head", 32768)


@pytest.mark.parametrize(("endpoint", "inward"), [(0x81, True), (0x02, False)])
def test_a_halted_pipe_is_a_failure(endpoint, inward):
    record = usbmon(event=b"C", endpoint=endpoint, status=-32, data=b"", length=0)
    assert usbmon_transfer(record, header=64, order="<") == Transfer((1, 5), inward, b"", 0, failed=True)
    record = usbpcap(info=1, endpoint=endpoint, status=0xC0000004, data=b"")
    assert usbpcap_transfer(record) == Transfer((1, 5), inward, b"", 0, failed=True)


@pytest.mark.parametrize("kind", (0, 1, 2))
def test_what_is_not_a_bulk_transfer_is_passed_over(kind):
    assert usbmon_transfer(usbmon(kind=kind), header=64, order="<") is None
    assert usbpcap_transfer(usbpcap(kind=kind)) is None


@pytest.mark.parametrize("extra", (0, 1, 12))
def test_usbpcap_with_headers_of_any_length(extra):
    assert usbpcap_transfer(usbpcap(extra=extra)) == Transfer((1, 5), False, WRAPPER, 31)
    assert usbpcap_transfer(usbpcap(info=1, endpoint=0x81, extra=extra)) == Transfer((1, 5), True, WRAPPER, 31)
    assert usbpcap_transfer(usbpcap(info=0, endpoint=0x81, extra=extra)) is None


@given(st.sampled_from(sorted(READERS)), st.sampled_from("<>"), st.binary(max_size=200))
def test_any_bytes_are_a_transfer_or_the_declared_error(link_type, order, record):
    try:
        found = READERS[link_type](record, order)
    except CaptureError:
        return
    assert found is None or len(found.data) <= len(record)
