"""A range image by a projector's Gray-code patterns: decoding and triangulation."""

from restore.structured_light.patterns import Projector
from restore.structured_light.rig import Lens, Rig
from restore.structured_light.scan import scan_captures

__all__ = ["Lens", "Projector", "Rig", "scan_captures"]
