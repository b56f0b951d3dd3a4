"""Simulated turntables: the nine controllers of the driver's table.

Each is on a separate serial port.
"""

from __future__ import annotations

from drivers.simulated.device.stage.controller import Machine
from drivers.simulated.device.stage.dialects import MACHINES, machine
from drivers.simulated.device.stage.pty import Fault, PtyStage

__all__ = ["MACHINES", "Fault", "Machine", "PtyStage", "machine"]
