"""Photographs of a page without a scan: its surface, and the cameras that took them."""

from restore.photogrammetry.cameras.card import SCALE_CARD, ScaleCard, detect_markers
from restore.photogrammetry.reconstruct import PhotographedPage, reconstruct_page

__all__ = ["SCALE_CARD", "PhotographedPage", "ScaleCard", "detect_markers", "reconstruct_page"]
