"""Rotary stages on a serial port; `open_stage` opens one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drivers.scanner import SettingsError, TransportError
from drivers.stage.controllers import BAUD, CONTROLLERS, Controller
from drivers.stage.rotary import RotaryStage

if TYPE_CHECKING:
    import serial

__all__ = ["CONTROLLERS", "Controller", "RotaryStage", "controller_named", "open_port", "open_stage"]

WRITE_TIMEOUT_S = 1.0  # the longest string takes 50 ms; with RTS/CTS a controller that is off accepts nothing


def controller_named(model: str, *, relative: bool = False) -> Controller:
    """Return the row of the table for a model.

    Raises SettingsError that lists the models, or when this one cannot be relative.
    """
    if model not in CONTROLLERS:
        raise SettingsError(f"the stage controller {model!r} does not exist", f"use one of: {', '.join(CONTROLLERS)}")
    if relative and not CONTROLLERS[model].ambiguous:
        raise SettingsError(f"the controller {model} counts from home", "leave `relative` out of [turntable]")
    return CONTROLLERS[model]


def open_stage(model: str, port: str, *, relative: bool = False) -> RotaryStage:
    """Open the controller of a turntable; nothing is sent yet.

    model     a model of the table.
    port      serial port, such as /dev/ttyUSB0.
    relative  see `RotaryStage`.
    Raises SettingsError as `controller_named`, TransportError when the port cannot be opened.
    """
    controller = controller_named(model, relative=relative)
    return RotaryStage(open_port(port, controller), controller, relative=relative)


def open_port(port: str, controller: Controller) -> serial.Serial:
    """Open the serial port exclusively, with a controller's line settings.

    Raises TransportError.
    """
    import serial

    try:
        return serial.Serial(
            port,
            BAUD,
            bytesize=serial.EIGHTBITS,
            parity=serial.PARITY_NONE,
            stopbits=serial.STOPBITS_ONE,
            rtscts=controller.handshake,
            timeout=0,
            write_timeout=WRITE_TIMEOUT_S,
            exclusive=True,
        )
    except (OSError, ValueError) as error:
        raise TransportError(
            f"cannot open the serial port {port}: {error}",
            "check `port` in [turntable]; a user who may open serial ports is in the group dialout (or uucp)",
        ) from error
