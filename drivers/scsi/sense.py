"""Sense data (SPC-4 §4.5): bytes ↔ key and codes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from drivers.scanner import SettingsError
from drivers.scsi.errors import BadReply

SENSE_LENGTH = 18  # fixed format up to its last fixed field
_FIXED, _DESCRIPTOR = (0x70, 0x71), (0x72, 0x73)  # response codes: of this command, of an earlier one
_DEFERRED = (0x71, 0x73)


class Key(IntEnum):
    """Sense keys."""

    NO_SENSE = 0x0
    RECOVERED_ERROR = 0x1
    NOT_READY = 0x2
    MEDIUM_ERROR = 0x3
    HARDWARE_ERROR = 0x4
    ILLEGAL_REQUEST = 0x5
    UNIT_ATTENTION = 0x6
    DATA_PROTECT = 0x7
    BLANK_CHECK = 0x8
    VENDOR_SPECIFIC = 0x9
    COPY_ABORTED = 0xA
    ABORTED_COMMAND = 0xB
    EQUAL = 0xC
    VOLUME_OVERFLOW = 0xD
    MISCOMPARE = 0xE
    COMPLETED = 0xF


@dataclass(frozen=True)
class Sense:
    """Why a command ended with CHECK CONDITION.

    key       sense key; code and qualifier: additional sense code and its qualifier, 0 to 255.
    deferred  True when it is about an earlier command.
    """

    key: Key
    code: int = 0
    qualifier: int = 0
    deferred: bool = False

    def __str__(self) -> str:
        name = self.key.name.replace("_", " ")
        return f"{name} {self.code:02X}h/{self.qualifier:02X}h"

    def build(self) -> bytes:
        """Return fixed-format sense data, 18 bytes.

        Raises SettingsError for a code that does not fit a byte.
        """
        if not (0 <= self.code <= 0xFF and 0 <= self.qualifier <= 0xFF):
            raise SettingsError(f"sense code {self.code}/{self.qualifier} is not two bytes")
        data = bytearray(SENSE_LENGTH)
        data[0], data[2], data[7] = _FIXED[self.deferred], self.key, SENSE_LENGTH - 8
        data[12], data[13] = self.code, self.qualifier
        return bytes(data)


def parse_sense(data: bytes) -> Sense:
    """Parse sense data of either format; codes that were cut off are 0.

    Raises BadReply for any other data.
    """
    response = data[0] & 0x7F if data else 0
    if response in _DESCRIPTOR and len(data) >= 4:
        key, code, qualifier = data[1], data[2], data[3]
    elif response in _FIXED and len(data) >= 3:
        # Bytes past the additional length are not sense data.
        end = min(len(data), 8 + data[7]) if len(data) > 7 else 0
        key, code, qualifier = data[2], *(data[at] if at < end else 0 for at in (12, 13))
    else:
        raise BadReply(f"sense data {data[:8].hex(' ') or 'of no bytes'} is in no format of the standard")
    return Sense(Key(key & 0x0F), code, qualifier, response in _DEFERRED)
