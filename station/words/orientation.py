"""Which way up a page is read, by Tesseract's detection of orientation."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

from restore import Finding, RestoredPage, rotate_page
from restore.scan import Bytes
from station.choices import Rotation
from station.errors import StationError
from station.images.png import encode_png
from station.words.words import Which, find_tesseract, run_tesseract, sized_for_reading

# Least difference of the log likelihoods of the two best orientations: Tesseract's own `min_orientation_margin`.
MIN_MARGIN = 7.0


def turned(page: RestoredPage, turn: Rotation, which: Which = shutil.which) -> tuple[RestoredPage, tuple[Finding, ...]]:
    """The page turned as asked for, AUTO by its words; and findings.

    Raises ProgramMissing for AUTO without Tesseract.
    """
    degrees = upright_turn(page.image, page.dpi, which=which) if turn == Rotation.AUTO else int(turn)
    return (page, (Finding.of("turn_undecided"),)) if degrees is None else (rotate_page(page, degrees), ())


def upright_turn(image: Bytes, dpi: float, *, which: Which = shutil.which) -> int | None:
    """Degrees, clockwise, that turn a page (h, w, 3) upright; None when its words are too few to tell.

    Raises ProgramMissing.
    """
    tesseract = find_tesseract(which)
    sized, scale = sized_for_reading(image, dpi)
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder, "page.png")
        picture.write_bytes(encode_png(sized))
        try:
            answer = run_tesseract(tesseract, picture, "stdout", "--psm", "0", "--dpi", str(round(dpi * scale)))
        except StationError:  # too few characters, or no data for the detection
            return None
    found = {
        key: re.search(rf"^{key}: ([\d.]+)$", answer, re.MULTILINE) for key in ("Rotate", "Orientation confidence")
    }
    rotate, margin = (match and float(match[1]) for match in found.values())
    return None if rotate is None or margin is None or margin < MIN_MARGIN else int(rotate)
