"""`planish card`: the sheet, drawn by another program, has its markers where they belong, to scale."""

from __future__ import annotations

import cv2
import numpy as np
import pypdfium2

from restore.photogrammetry.cameras.card import SCALE_CARD, detect_markers
from station.cli import main

DPI = 300
SCALE_ERROR = 2e-4  # a tenth of a pixel at this resolution over the length of the card


def rendered(path) -> np.ndarray:
    """(h, w, 3) uint8: the first page of a PDF at DPI."""
    document = pypdfium2.PdfDocument(path)
    try:
        return np.array(document[0].render(scale=DPI / 72).to_pil().convert("RGB"))
    finally:
        document.close()


def test_the_printed_card_is_true_to_scale(tmp_path, capsys):
    path = tmp_path / "card.pdf"
    assert main(["card", "-o", str(path)]) == 0
    assert "100 %" in capsys.readouterr().out
    found = detect_markers(rendered(path))
    assert sorted(found) == list(range(len(SCALE_CARD.centres)))
    pixels = np.array([found[number] for number in sorted(found)]) * [1, -1] * 25.4 / DPI
    known = SCALE_CARD.centres
    pixels, known = pixels - pixels.mean(axis=0), known - known.mean(axis=0)
    scale = (pixels * known).sum() / (known**2).sum()
    assert abs(scale - 1) < SCALE_ERROR
    np.testing.assert_allclose(pixels, known, atol=0.05)  # half a pixel


def test_the_ruler_is_as_long_as_it_says(tmp_path):
    path = tmp_path / "card.pdf"
    main(["card", "-o", str(path)])
    dark = cv2.cvtColor(rendered(path), cv2.COLOR_RGB2GRAY) < 128
    card_bottom = (279 - (279 - 30 - SCALE_CARD.size_mm[1])) * DPI / 25.4
    rows = dark[int(card_bottom) + 20 : int(card_bottom + 20 * DPI / 25.4)]
    longest = max(np.ptp(np.flatnonzero(row)) if row.any() else 0 for row in rows)
    assert abs(longest * 25.4 / DPI - 100.0) < 0.3  # the ends of the line have a width of 0.2 mm


def test_nothing_is_overwritten_unasked(tmp_path, capsys):
    path = tmp_path / "card.pdf"
    path.write_text("mine")
    assert main(["card", "-o", str(path)]) == 2
    assert "--force" in capsys.readouterr().err
    assert path.read_text() == "mine"
