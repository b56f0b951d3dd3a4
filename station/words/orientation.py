"""Which way up a page is, and whether it is mirrored, as its words are read."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from restore import Finding, RestoredPage, mirror_page, rotate_page
from restore.scan import Bytes
from station.choices import Rotation
from station.errors import StationError
from station.images.png import encode_png
from station.words.words import (
    DOUBTFUL,
    Which,
    find_tesseract,
    letters_of,
    run_tesseract,
    sized_for_reading,
)

# Least difference of the log likelihoods of the two best orientations: Tesseract's own `min_orientation_margin`.
MIN_MARGIN = 7.0
PART_INCHES = 2.0  # side of the part of a page that is read in every direction: some dozens of words of its text
MIN_LETTERS = 20  # in it: chance reads words of three
CLEARLY = 1.5  # times the confidence of any other direction: 96 of 100 against 20 to 45 in print that is read at all


class Upright(NamedTuple):
    """How a page becomes upright: mirrored if needed, then rotated by right angles."""

    degrees: int
    mirrored: bool = False


def turned(
    page: RestoredPage, turn: Rotation, which: Which = shutil.which, *, language: str = "eng"
) -> tuple[RestoredPage, tuple[Finding, ...]]:
    """Rotate the page as asked for, AUTO by its words.

    They may show that it is a mirror image, too. Returns also findings. Raises ProgramMissing for AUTO without
    Tesseract.
    """
    if turn != Rotation.AUTO:
        return rotate_page(page, int(turn)), ()
    found = upright_turn(page.image, page.dpi, which=which, language=language)
    if found is None:
        return page, (Finding.of("turn_undecided"),)
    if not found.mirrored:
        return rotate_page(page, found.degrees), ()
    return rotate_page(mirror_page(page), found.degrees), (Finding.of("words_mirrored"),)


def upright_turn(image: Bytes, dpi: float, *, which: Which = shutil.which, language: str = "eng") -> Upright | None:
    """What makes a page (h, w, 3) upright; None when its words are too few to decide.

    Where Tesseract's detection of orientation is not certain, a part of the page is read in the four directions, and
    mirrored. Raises ProgramMissing.
    """
    tesseract = find_tesseract(which)
    sized, scale = sized_for_reading(image, dpi)
    degrees = _detected(tesseract, sized, dpi * scale)
    return _by_reading(tesseract, sized, dpi * scale, language) if degrees is None else Upright(degrees)


def _detected(tesseract: Path, image: Bytes, dpi: float) -> int | None:
    """Return the rotation that Tesseract detects, None where its margin is small."""
    try:
        answer = _run(tesseract, image, dpi, "--psm", "0")
    except StationError:  # too few characters, or no data for the detection
        return None
    found = {
        key: re.search(rf"^{key}: ([\d.]+)$", answer, re.MULTILINE) for key in ("Rotate", "Orientation confidence")
    }
    rotate, margin = (match and float(match[1]) for match in found.values())
    return None if rotate is None or margin is None or margin < MIN_MARGIN else int(rotate)


def _by_reading(tesseract: Path, image: Bytes, dpi: float, language: str) -> Upright | None:
    """Return the direction in which a part of the page is read with far more confidence."""
    part = densest_part(image, dpi)
    if part is None:
        return None
    read: dict[Upright, float] = {}
    for mirrored in (False, True):
        for degrees in (0, 90, 180, 270):
            seen = np.ascontiguousarray(np.rot90(part[:, ::-1] if mirrored else part, -degrees // 90))
            read[Upright(degrees, mirrored)] = _confidence(tesseract, seen, dpi, language)
        second, best = sorted(read, key=read.__getitem__)[-2:]
        if read[best] >= DOUBTFUL and read[best] > CLEARLY * read[second]:
            return best
    return None


def densest_part(image: Bytes, dpi: float) -> Bytes | None:
    """Return the part of a page (h, w, 3), PART_INCHES wide, that has most letters, or None."""
    centres = letters_of(image, dpi).centres
    if len(centres) < MIN_LETTERS:
        return None
    cell = max(round(PART_INCHES * dpi / 8), 1)
    counts = np.zeros([side // cell + 1 for side in image.shape[:2]], np.float32)
    np.add.at(counts, tuple((centres[:, ::-1] / cell).astype(int).T), 1.0)
    around = cv2.boxFilter(counts, -1, (8, 8), normalize=False, borderType=cv2.BORDER_CONSTANT)
    middle = (np.array(np.unravel_index(int(around.argmax()), around.shape)) + 0.5) * cell
    low = np.clip((middle - 4 * cell).astype(int), 0, None)
    return np.ascontiguousarray(image[low[0] : low[0] + 8 * cell, low[1] : low[1] + 8 * cell])


def _confidence(tesseract: Path, image: Bytes, dpi: float, language: str) -> float:
    """Return the mean confidence in the letters of an image, 0 to 100.

    It is read as one block; 0 for few letters. Tesseract's own analysis of a page rotates text that stands on its side,
    and would read that as well.
    """
    table = _run(tesseract, image, dpi, "--psm", "6", "-l", language, "tsv")
    rows = [row for line in table.splitlines()[1:] if len(row := line.split("\t")) == 12 and row[11].strip()]
    letters = np.array([sum(map(str.isalpha, row[11])) for row in rows], float)
    if letters.sum() < MIN_LETTERS:
        return 0.0
    return float(letters @ [float(row[10]) for row in rows] / letters.sum())


def _run(tesseract: Path, image: Bytes, dpi: float, *options: str) -> str:
    """What Tesseract prints of an image with options."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder, "page.png")
        picture.write_bytes(encode_png(image))
        return run_tesseract(tesseract, picture, "stdout", "--dpi", str(round(dpi)), *options)
