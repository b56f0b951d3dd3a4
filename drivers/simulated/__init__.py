"""A simulated Vivid 900: warped pages whose flat truth is known, seen through the scanner's optics.

`connect(config)` opens it as a scanner: the real driver over a device that answers bytes, which is `rig(config)`.
`shoot(sheet, …)` is one shot without any of that, together with the truth about it.
"""

from __future__ import annotations

from drivers.simulated.artwork import Figure, Markers, Text, White
from drivers.simulated.scanner import Rig, connect, connect_turntable, rig
from drivers.simulated.scene import Pose
from drivers.simulated.sheets import Binding, Cone, Crumpled, Curl, Flat, Miura, MultiFold, Spread, Wave
from drivers.simulated.shot import Truth, shoot

__all__ = [
    "Binding",
    "Cone",
    "Crumpled",
    "Curl",
    "Figure",
    "Flat",
    "Markers",
    "Miura",
    "MultiFold",
    "Pose",
    "Rig",
    "Spread",
    "Text",
    "Truth",
    "Wave",
    "White",
    "connect",
    "connect_turntable",
    "rig",
    "shoot",
]
