"""Recognises the folders that scanning programs of phones export.

They are not read. The readers are imported only for such a folder: they bring photogrammetry with them.
"""

from __future__ import annotations

from pathlib import Path

from restore.formats.parsing.source import is_file, is_folder

POLYCAM_CAMERAS = ("keyframes/cameras", "keyframes/corrected_cameras")
SCANNER_APP_MESHES = ("textured_output.obj", "export.obj", "export_refined.obj")
SCANNER_APP_FRAMES = "frame_*.json"


def is_phone_capture(path: Path) -> bool:
    """Return whether a path is a phone's export with photographs and their cameras."""
    return is_polycam(path) or is_scanner_app(path)


def is_polycam(folder: Path) -> bool:
    """Whether a folder is Polycam's export of raw data."""
    return any(is_folder(folder / name) for name in POLYCAM_CAMERAS)


def is_scanner_app(folder: Path) -> bool:
    """Whether a folder is the export "All data" of 3d Scanner App."""
    has_frame = folder.is_dir() and next(folder.glob(SCANNER_APP_FRAMES), None) is not None
    return has_frame and any(is_file(folder / name) for name in SCANNER_APP_MESHES)
