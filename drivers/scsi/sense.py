"""Sense data (SPC-4 §4.5): bytes ↔ key and codes, and the error that each stands for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from drivers.scanner import DeviceError, ScannerError, SettingsError
from drivers.vivid900.errors import SCAN_AGAIN, BadReply, CommandRefused, HardwareFault, Interrupted, NotReady
from drivers.vivid900.faults import panel_error

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
        """Fixed-format sense data, 18 bytes. Raises SettingsError for a code that is no byte."""
        if not (0 <= self.code <= 0xFF and 0 <= self.qualifier <= 0xFF):
            raise SettingsError(f"sense code {self.code}/{self.qualifier} is not two bytes")
        data = bytearray(SENSE_LENGTH)
        data[0], data[2], data[7] = _FIXED[self.deferred], self.key, SENSE_LENGTH - 8
        data[12], data[13] = self.code, self.qualifier
        return bytes(data)


def parse_sense(data: bytes) -> Sense:
    """Read sense data of either format; codes that were cut off are 0. Raises BadReply for anything else."""
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


_BY_CODE: dict[tuple[Key, int, int], tuple[type[ScannerError], str, str]] = {
    (Key.NOT_READY, 0x04, 0x01): (NotReady, "the scanner is warming up", "wait ten seconds, then scan again"),
    (Key.NOT_READY, 0x3E, 0x01): (HardwareFault, "the scanner failed its self test", "switch it off, wait five "
                                  "seconds, switch it on; if it comes back, it needs service"),
    (Key.ILLEGAL_REQUEST, 0x20, 0x00): (CommandRefused, "the scanner does not know the command", ""),
    (Key.ILLEGAL_REQUEST, 0x24, 0x00): (CommandRefused, "the scanner does not take a field of the command", ""),
    (Key.ILLEGAL_REQUEST, 0x25, 0x00): (CommandRefused, "there is no such logical unit", "check the target number"),
    (Key.ILLEGAL_REQUEST, 0x26, 0x00): (CommandRefused, "the scanner does not take one of the parameters", ""),
    (Key.ILLEGAL_REQUEST, 0x2C, 0x00): (Interrupted, "the scanner has forgotten the shot it was asked for", SCAN_AGAIN),
    (Key.UNIT_ATTENTION, 0x28, 0x00): (Interrupted, "something was changed at the scanner", SCAN_AGAIN),
    (Key.UNIT_ATTENTION, 0x29, 0x00): (Interrupted, "the scanner was switched on or reset", SCAN_AGAIN),
    (Key.UNIT_ATTENTION, 0x2A, 0x00): (Interrupted, "parameters were changed at the scanner", SCAN_AGAIN),
    (Key.ABORTED_COMMAND, 0x47, 0x00): (Interrupted, "parity error on the SCSI bus", "check cables and termination"),
}  # fmt: skip

_BY_KEY: dict[Key, tuple[type[ScannerError], str, str]] = {
    Key.NO_SENSE: (BadReply, "the scanner reports a fault and calls it none", SCAN_AGAIN),
    Key.RECOVERED_ERROR: (BadReply, "the scanner reports a fault that it got over", SCAN_AGAIN),
    Key.NOT_READY: (NotReady, "the scanner is not ready", "look at its panel"),
    Key.MEDIUM_ERROR: (HardwareFault, "the scanner cannot use its memory card", "take the card out"),
    Key.HARDWARE_ERROR: (HardwareFault, "a part of the scanner has failed", "switch it off, wait five seconds, switch "
                         "it on; if it comes back, it needs service"),
    Key.ILLEGAL_REQUEST: (CommandRefused, "the scanner refuses the command", ""),
    Key.UNIT_ATTENTION: (Interrupted, "something happened to the scanner", SCAN_AGAIN),
    Key.DATA_PROTECT: (HardwareFault, "the scanner's memory is protected", "look at its panel"),
    Key.BLANK_CHECK: (HardwareFault, "the scanner finds nothing in its memory", "look at its panel"),
    Key.VENDOR_SPECIFIC: (DeviceError, "the scanner reports a fault of its vendor's own list", "look at its panel"),
    Key.COPY_ABORTED: (Interrupted, "the scanner gave the command up", SCAN_AGAIN),
    Key.ABORTED_COMMAND: (Interrupted, "the scanner gave the command up", SCAN_AGAIN),
    Key.EQUAL: (BadReply, "the scanner answers a search that was never asked", SCAN_AGAIN),
    Key.VOLUME_OVERFLOW: (HardwareFault, "the scanner's memory is full", "look at its panel"),
    Key.MISCOMPARE: (HardwareFault, "the scanner's memory differs from what was written", "look at its panel"),
    Key.COMPLETED: (BadReply, "the scanner reports a fault and calls it none", SCAN_AGAIN),
}  # fmt: skip

_PROFILE_HINT = "the command profile does not fit this scanner's firmware"


def error_of(sense: Sense, panels: Mapping[tuple[int, int], str] | None = None) -> ScannerError:
    """The error that sense data stands for; never fails.

    panels  vendor's own (code, qualifier) → the front panel's message, from the command profile.
    """
    panel = (panels or {}).get((sense.code, sense.qualifier))
    if panel is not None:
        return panel_error(panel)
    # Qualifiers of 28h to 2Ah only say how it came about.
    qualifier = 0 if sense.key is Key.UNIT_ATTENTION else sense.qualifier
    kind, message, hint = _BY_CODE.get((sense.key, sense.code, qualifier), _BY_KEY[sense.key])
    return kind(f"{message} ({sense})", hint or _PROFILE_HINT)
