"""Faults that the scanner reports, and the error that each stands for.

Messages of the front panel: hardware manual 9222-1888-19 p. 54-55. Sense data: SPC-4 §4.5.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivers.scanner import DeviceError, ScannerError
from drivers.scsi.errors import SCAN_AGAIN, BadReply
from drivers.scsi.sense import Key, Sense
from drivers.vivid900.errors import BarrierClosed, CommandRefused, HardwareFault, Interrupted, NotReady, PanelError

SERVICE = "switch the scanner off, wait five seconds, switch it on; if it comes back, it needs service"


@dataclass(frozen=True)
class Panel:
    """A message of the panel: what it means here, and what to do now."""

    meaning: str
    hint: str
    kind: type[DeviceError] = PanelError


PANELS: dict[str, Panel] = {
    "AF/AE ERROR LASER BARRIER MAY BE CLOSED": Panel(
        "the laser barrier stands before the laser",
        "take the barrier off the laser window, press any key on the scanner, scan again",
        BarrierClosed,
    ),
    "AF ERROR LOW CONTRAST": Panel(
        "nothing to focus on: the page is too even",
        "set distance_mm to the distance from the front of the lens to the page",
    ),
    "BACKUP ERROR": Panel("the scanner lost its settings", "set its clock and SCSI ID again in its menu"),
    "CAUTION LASER SCANNER IS OUT OF ORDER PLEASE TURN OFF": Panel(
        "the laser scanner is out of order", "switch it off now; it needs service", HardwareFault
    ),
    "CHANGE LENS": Panel("the scanner asks for another lens", "mount the lens that its panel names"),
    "CLOCK ERROR": Panel("the scanner's clock stands still", "set its clock in its menu"),
    "DIRECTORY FULL": Panel("the directory of the memory card is full", "delete files on the card, or take it out"),
    "ERROR OUT OF DISTANCE RANGE (0.5-2.5 m)": Panel(
        "the page is nearer than 0.5 m or farther than 2.5 m", "move the page or the scanner"
    ),
    "INVALID FORMAT": Panel("the memory card has a format that is not the scanner's", "take the card out"),
    "LIGHT IMPROPER": Panel("the light is too strong or too weak", "shade the page from sun and lamps: 500 lx at most"),
    "NO FREE SPACE": Panel("the memory card is full", "delete files on the card, or take it out"),
    "NO MEMORY CARD": Panel("the scanner asks for its memory card", "put the card in, or switch recording off"),
    "MEMORY CARD IS EJECTED (RECORDING IS CANCELED)": Panel("the memory card was taken out", "scan again"),
    "SAME FILE NAME": Panel("the memory card has a file of that name", "delete it on the card, or take the card out"),
    "SYSTEM ERROR": Panel("a part of the scanner has failed", SERVICE, HardwareFault),
    "TERMINATE ERROR": Panel(
        "the SCSI bus is not terminated as it should be",
        "terminate the last device of the bus and no other: menu CAMERA SETTINGS, TERMINATE",
    ),
    "UNKNOWN MEMORY CARD": Panel("the memory card is of a kind that the scanner does not know", "take the card out"),
    "WB ERROR LIGHT IMPROPER": Panel(
        "no white balance in this light", "calibrate on white paper by daylight lamps, at 500 lx at most"
    ),
}
"""Text of the panel → what it means. Texts that name a lens end before the name."""


def panel_error(text: str) -> DeviceError:
    """Return the error for a message of the panel.

    A message that the manual does not list is quoted.
    """
    panel = PANELS.get(text, Panel(f"its panel shows {text!r}", "see the scanner's manual"))
    message = f"{panel.meaning} ({text})" if text in PANELS else panel.meaning
    if panel.kind is PanelError:
        return PanelError(text, message, panel.hint)
    return panel.kind(message, panel.hint)


_BY_CODE: dict[tuple[Key, int, int], tuple[type[ScannerError], str, str]] = {
    (Key.NOT_READY, 0x04, 0x01): (NotReady, "the scanner is warming up", "wait ten seconds, then scan again"),
    (Key.NOT_READY, 0x3E, 0x01): (HardwareFault, "the scanner failed its self test", "switch it off, wait five "
                                  "seconds, switch it on; if it comes back, it needs service"),
    (Key.ILLEGAL_REQUEST, 0x20, 0x00): (CommandRefused, "the scanner does not know the command", ""),
    (Key.ILLEGAL_REQUEST, 0x24, 0x00): (CommandRefused, "the scanner does not take a field of the command", ""),
    (Key.ILLEGAL_REQUEST, 0x25, 0x00): (CommandRefused, "the logical unit does not exist", "check the target number"),
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
