"""Folders of captured patterns of structured light.

They hold the pictures that a camera took of a surface under a projector's patterns.

calibration.yml | .yaml | .xml | .json   camera and projector, as `restore.formats.calibration` reads them
patterns.json                            what `planish patterns` wrote: the projector's resolution
*.png, *.tif, *.jpg, …                   the pictures, in the order of their names: patterns, white, black
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import cv2
from pydantic import BaseModel, ValidationError

from restore.errors import BadInput
from restore.formats.calibration import read_rig
from restore.formats.parsing.picture import SUFFIXES, read_image
from restore.formats.parsing.source import DAMAGED, is_file, read_bytes
from restore.scan import Bytes, RangeScan
from restore.structured_light import Projector, scan_captures

CALIBRATIONS = ("calibration.yml", "calibration.yaml", "calibration.xml", "calibration.json")
PATTERNS = "patterns.json"
MAX_INDEX_BYTES = 2**16  # a line of text
NUMBER = re.compile(r"(\d+)")


class PatternIndex(BaseModel):
    """The contents of patterns.json."""

    projector: tuple[int, int]


def is_captures(folder: Path) -> bool:
    """Whether a folder holds captured patterns with their calibration."""
    return any(is_file(folder / name) for name in CALIBRATIONS)


def read_captures(folder: Path) -> RangeScan:
    """Read the range image of a folder of captured patterns.

    Raises BadInput, NotEnoughSurface.
    """
    calibration = next(folder / name for name in CALIBRATIONS if is_file(folder / name))
    rig = read_rig(calibration, _projector(folder / PATTERNS))
    paths = sorted((path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES), key=_in_order)
    if len(paths) != rig.projector.count:  # before any is read: they may be gigabytes
        raise BadInput(
            f"{folder} holds {len(paths)} images, the patterns of a projector of {rig.projector.width} × "
            f"{rig.projector.height} pixels are {rig.projector.count}",
            "put the image of every pattern there, white and black at the end, and no other",
        )
    greys, white = _pictures(paths)
    return scan_captures(greys, white, rig)


def _projector(path: Path) -> Projector | None:
    if not is_file(path):
        return None
    try:
        return Projector(*PatternIndex.model_validate_json(read_bytes(path, MAX_INDEX_BYTES)).projector)
    except ValidationError as error:
        raise BadInput(f"{path} does not say the resolution of a projector", DAMAGED) from error


def _in_order(path: Path) -> list[tuple[int, str]]:
    """The key by which names are sorted as people number them: 2 before 10."""
    return [(int(part), "") if part.isdigit() else (-1, part.lower()) for part in NUMBER.split(path.name) if part]


def _pictures(paths: Sequence[Path]) -> tuple[list[Bytes], Bytes]:
    """The brightness (h, w) of every picture, and the white one (h, w, 3)."""
    greys: list[Bytes] = []
    for path in paths:
        picture = read_image(path)
        if greys and picture.shape[:2] != greys[0].shape:
            raise BadInput(
                f"{path} has {picture.shape[1]} × {picture.shape[0]} pixels, {paths[0].name} has "
                f"{greys[0].shape[1]} × {greys[0].shape[0]}",
                "capture all patterns with one camera, without turning or zooming it",
            )
        greys.append(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY))
        if len(greys) == len(paths) - 1:
            white = picture
    return greys, white
