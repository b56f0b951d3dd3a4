"""A simulated Vivid 900: warped pages with known ground truth, seen by its optics.

`connect(config)` opens it as a scanner: the real driver over `rig(config)`, a device that answers command bytes.
`shoot(sheet, …)` takes one capture without driver and device, and returns it with its ground truth.
"""

from __future__ import annotations

from drivers.simulated.imaging.shot import Truth, shoot
from drivers.simulated.scanner import Rig, connect, connect_turntable, open_link, rig
from drivers.simulated.scene.artwork import Chart, Engraving, Facing, Figure, Leather, Markers, Text, White
from drivers.simulated.scene.scene import Pose
from drivers.simulated.scene.sheets import Binding, Cone, Crumpled, Curl, Flat, Miura, MultiFold, Opening, Spread, Wave

__all__ = [
    "Binding",
    "Chart",
    "Cone",
    "Crumpled",
    "Curl",
    "Engraving",
    "Facing",
    "Figure",
    "Flat",
    "Leather",
    "Markers",
    "Miura",
    "MultiFold",
    "Opening",
    "Pose",
    "Rig",
    "Spread",
    "Text",
    "Truth",
    "Wave",
    "White",
    "connect",
    "connect_turntable",
    "open_link",
    "rig",
    "shoot",
]
