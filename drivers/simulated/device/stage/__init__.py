"""Simulated rotary stages: the nine controllers of the driver's table, each on a serial port of its own."""

from __future__ import annotations

from drivers.simulated.device.stage.controller import Machine
from drivers.simulated.device.stage.dialects import MACHINES, machine
from drivers.simulated.device.stage.pty import Fault, PtyStage

__all__ = ["MACHINES", "Fault", "Machine", "PtyStage", "machine"]
