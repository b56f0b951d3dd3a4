"""Messages of the front panel (hardware manual 9222-1888-19 p. 54-55), their meaning and what to do about each."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.scanner import DeviceError
from drivers.vivid900.errors import BarrierClosed, HardwareFault, PanelError

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
    """The error for a message of the panel; a message that the manual does not list is quoted."""
    panel = PANELS.get(text, Panel(f"its panel shows {text!r}", "see the scanner's manual"))
    message = f"{panel.meaning} ({text})" if text in PANELS else panel.meaning
    if panel.kind is PanelError:
        return PanelError(text, message, panel.hint)
    return panel.kind(message, panel.hint)
