"""A simulated Vivid 900: warped pages whose flat truth is known, seen through the scanner's optics.

`connect(config)` opens it as a scanner; `shoot(sheet, …)` is one shot together with the truth about it.
"""

from __future__ import annotations

from drivers.simulated.artwork import Chart, Figure, Markers, Text, White
from drivers.simulated.scanner import SimulatedScanner, connect
from drivers.simulated.scene import Pose
from drivers.simulated.sheets import Binding, Cone, Crumpled, Curl, Flat, Miura, MultiFold, Spread, Wave
from drivers.simulated.shot import Truth, shoot

__all__ = [
    "Binding",
    "Chart",
    "Cone",
    "Crumpled",
    "Curl",
    "Figure",
    "Flat",
    "Markers",
    "Miura",
    "MultiFold",
    "Pose",
    "SimulatedScanner",
    "Spread",
    "Text",
    "Truth",
    "Wave",
    "White",
    "connect",
    "shoot",
]
