"""Words of an hOCR page, and the invisible text of a PDF: each word as wide as its print, one space between two."""

import re

import pytest

from station.words.text_layer import GLYPH_WIDTH, Line, Word, content_of, paragraphs_of

HOCR = b"""<?xml version="1.0" encoding="UTF-8"?>
<html xmlns="http://www.w3.org/1999/xhtml"><body>
<div class="ocr_page" title="image &quot;p.png&quot;; bbox 0 0 800 600">
<p class="ocr_par" title="bbox 100 100 700 140">
<span class="ocr_line" title="bbox 100 100 700 140; baseline 0.01 -8; x_size 40">
<span class="ocrx_word" title="bbox 100 100 300 132; x_wconf 96">Gro\xc3\x9f</span>
<span class="ocrx_word" title="bbox 340 100 700 132; x_wconf 90"><strong>Papier</strong></span></span></p>
<p class="ocr_par" title="bbox 0 0 800 600"><span class="ocr_line" title="bbox 0 0 800 600">
<span class="ocrx_word" title="bbox 0 0 800 600; x_wconf 95"> </span></span></p>
</div></body></html>"""
RUN = re.compile(r"([\d.]+) Tz 1 0 0 1 ([\d.]+) ([\d.]+) Tm <([0-9A-F]+)> Tj")
HEIGHT = 300.0
DIGITS = 0.01  # pixels: the file keeps three digits of a stretch in per cent


def runs(content):
    """(text, left, right, y) of every run of a content stream whose type has the size 20."""
    for stretch, left, y, codes in RUN.findall(content.decode()):
        width = float(stretch) / 100 * len(codes) / 4 * GLYPH_WIDTH * 20
        yield bytes.fromhex(codes).decode("utf-16-be"), float(left), float(left) + width, float(y)


def test_an_hocr_page_is_read_in_pixels_of_the_page_itself():
    ((line,),) = paragraphs_of(HOCR, 2.0)
    assert [word.text for word in line.words] == ["Groß", "Papier"]
    assert (line.words[0].left, line.words[0].right, line.words[1].right) == (50.0, 150.0, 350.0)
    assert (line.size, line.left) == (20.0, 50.0)
    assert line.base_at(50.0) == pytest.approx(66.0)
    assert line.base_at(350.0) == pytest.approx(69.0)


def test_words_end_where_they_end_and_one_space_fills_the_gap():
    found = list(runs(content_of(paragraphs_of(HOCR, 2.0), HEIGHT, "/f")))
    assert [text for text, *_ in found] == ["Groß", " ", "Papier", " "]
    for (_, left, right, _), (start, end) in zip(found, [(50, 150), (150, 170), (170, 350)], strict=False):
        assert (left, right) == (pytest.approx(start, abs=DIGITS), pytest.approx(end, abs=DIGITS))
    assert found[0][3] == pytest.approx(HEIGHT - 66.5, abs=DIGITS)


def test_every_paragraph_has_a_mark_of_its_own():
    line = Line((Word("a", 0.0, 10.0),), 0.0, 20.0, 0.0, 20.0)
    content = content_of([(line,), (line, line)], HEIGHT, "/f").decode()
    assert re.findall(r"/MCID (\d+)", content) == ["0", "1"]
    assert content.count("BDC") == content.count("EMC") == content.count("ET") == 2
    assert content_of([], HEIGHT, "/f") == b""


def test_words_that_touch_have_no_space_between_them_and_codes_beyond_16_bits_are_two():
    line = Line((Word("𝔓", 0.0, 10.0), Word("b", 10.0, 20.0)), 0.0, 20.0, 0.0, 20.0)
    found = list(runs(content_of([(line,)], HEIGHT, "/f")))
    assert [(text, right) for text, _, right, _ in found[:2]] == [
        ("𝔓", pytest.approx(10.0, abs=DIGITS)),
        ("b", pytest.approx(20.0, abs=DIGITS)),
    ]
