"""Contents of a command profile: allowed and required ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

PARAMETERS = ("distance_mm", "laser_power", "gain", "mode", "threshold", "auto_read", "colour")

CommandName = Literal[
    "read_parameters", "write_parameters", "passive_autofocus", "active_autofocus", "release", "status", "read_pitch",
    "read_colour",
]  # fmt: skip
COMMAND_FIELDS: Mapping[CommandName, frozenset[str]] = {
    "read_parameters": frozenset({"length"}),
    "write_parameters": frozenset({"length"}),
    "passive_autofocus": frozenset(),
    "active_autofocus": frozenset(),
    "release": frozenset(PARAMETERS),
    "status": frozenset({"length"}),
    "read_pitch": frozenset({"offset", "length"}),
    "read_colour": frozenset({"offset", "length", "kind"}),
}
"""Which fields a command, or the data sent with it, may have."""

REQUIRED = (
    "commands.read_parameters", "commands.write_parameters", "commands.release", "commands.read_pitch",
    "blocks.parameters.distance_mm", "blocks.parameters.laser_power", "mode", "pitch.pixel",
)  # fmt: skip
"""Keys of a trusted profile; `mode` is in the parameters or in the release."""
STATUS_REQUIRED = "blocks.status.state", "states.ready"
"""And with a status command, this as well."""

CONSEQUENCES: Mapping[str, str] = {
    "commands.status": "TEST UNIT READY is polled instead; `lens` in [scanner], or a calibration, names the lens",
    "commands.passive_autofocus": "the laser focuses, or distance_mm in [capture]",
    "commands.active_autofocus": "previews alone find the exposure; even pages need distance_mm in [capture]",
    "commands.read_colour": "scans have no colour: texture the page from a photograph (--photo)",
    "blocks.status.shot": "no check that the scanner took the capture",
    "blocks.status.panel": "messages of the front panel are known only where sense data report them",
    "blocks.status.lens": "`lens` in [scanner], or a calibration, names the lens",
    "blocks.status.lens_serial": "no check that the calibration is this lens's",
    "blocks.status.body_serial": "no check that the calibration is this body's",
    "blocks.pitch.shot": "no check that the range image is of this capture",
    "blocks.colour.shot": "no check that the colour image is of this capture",
    "blocks.pitch.checksum": "the range image is read twice and compared",
    "blocks.colour.checksum": "the colour image is read twice and compared",
    "blocks.parameters.gain": "gain cannot be set",
    "blocks.parameters.threshold": "the scanner chooses the threshold",
    "blocks.parameters.auto_read": "previews take the colour image as well",
    "blocks.parameters.colour": "the scanner chooses the colour's exposure",
    "pitch.intensity": "no exposure from previews: set laser_power in [capture]",
}
"""What may be left out, and what that means."""
