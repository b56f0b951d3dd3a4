"""Commands of every SCSI device: INQUIRY, TEST UNIT READY, REQUEST SENSE.

Source: SCSI-2 §8.2. Only these are sent to a scanner before a command profile is known to fit it.
"""

from __future__ import annotations

from dataclasses import dataclass

from drivers.scanner import SettingsError
from drivers.scsi.errors import BadReply

TEST_UNIT_READY, REQUEST_SENSE, INQUIRY = 0x00, 0x03, 0x12
STANDARD = frozenset({TEST_UNIT_READY, REQUEST_SENSE, INQUIRY})
"""Operation codes that are safe to send to any device."""

INQUIRY_LENGTH = 36  # the standard part; anything beyond it is vendor-specific
MAX_ALLOCATION = 0xFF  # one byte in a CDB of six
SCANNER_TYPE, PROCESSOR_TYPE = 0x06, 0x03
SCSI_2 = 0x02
_TEXT_AT = {"vendor": (8, 16), "product": (16, 32), "revision": (32, 36)}


def test_unit_ready() -> bytes:
    """CDB of TEST UNIT READY; moves no data."""
    return bytes(6)


def inquiry(length: int = INQUIRY_LENGTH) -> bytes:
    """Return the CDB of INQUIRY for up to `length` bytes.

    Raises SettingsError for a length that the CDB cannot hold.
    """
    return _with_allocation(INQUIRY, length)


def request_sense(length: int) -> bytes:
    """Return the CDB of REQUEST SENSE for up to `length` bytes.

    Raises SettingsError for a length that the CDB cannot hold.
    """
    return _with_allocation(REQUEST_SENSE, length)


def _with_allocation(opcode: int, length: int) -> bytes:
    if not 0 <= length <= MAX_ALLOCATION:
        raise SettingsError(f"{length} bytes cannot be asked for", f"ask for 0 to {MAX_ALLOCATION}")
    return bytes([opcode, 0, 0, 0, length, 0])


@dataclass(frozen=True)
class Identity:
    """The INQUIRY data of a device.

    device_type  peripheral device type, 0 to 31. Which one the Vivid 900 reports is not known: none is required.
    vendor       at most 8 printable ASCII characters, product 16, revision 4, without blanks at their ends.
    version      SCSI version, 0 to 7.
    connected    False when the target has no such unit attached (peripheral qualifier 1 or 3).
    """

    device_type: int
    vendor: str
    product: str
    revision: str
    version: int = SCSI_2
    connected: bool = True

    def __str__(self) -> str:
        return " ".join(filter(None, (self.vendor, self.product, self.revision)))

    def build(self) -> bytes:
        """INQUIRY data, 36 bytes. Raises SettingsError for text or numbers that do not fit."""
        if not (0 <= self.device_type < 32 and 0 <= self.version < 8):
            raise SettingsError(f"no device type {self.device_type} of SCSI version {self.version}")
        data = bytearray(INQUIRY_LENGTH)
        data[0] = self.device_type | (0 if self.connected else 0x20)
        data[2:5] = self.version, 2, INQUIRY_LENGTH - 5
        for name, (start, end) in _TEXT_AT.items():
            text: str = getattr(self, name)
            if len(text) > end - start or text != _printable(text.encode("utf-8")):
                raise SettingsError(
                    f"{name} {text!r} does not fit", f"{end - start} printable ASCII characters at most"
                )
            data[start:end] = text.encode("ascii").ljust(end - start)
        return bytes(data)


def parse_identity(data: bytes) -> Identity:
    """Parse INQUIRY data; unprintable characters are dropped.

    Raises BadReply when it is too short.
    """
    if len(data) < INQUIRY_LENGTH:
        raise BadReply(f"INQUIRY data of {len(data)} bytes, {INQUIRY_LENGTH} are the least")
    texts = {name: _printable(data[start:end]) for name, (start, end) in _TEXT_AT.items()}
    return Identity(data[0] & 0x1F, **texts, version=data[2] & 0x07, connected=data[0] >> 5 == 0)


def _printable(text: bytes) -> str:
    return "".join(chr(byte) for byte in text if 0x20 <= byte < 0x7F).strip()
