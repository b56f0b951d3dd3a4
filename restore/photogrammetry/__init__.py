"""Photographs of a page without a scan: its surface, and the cameras that took them."""

from restore.photogrammetry.card import SCALE_CARD, ScaleCard, detect_markers

__all__ = ["SCALE_CARD", "ScaleCard", "detect_markers"]
