"""Recognised lines and words of an hOCR file, and their invisible text in a PDF."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

XHTML = "{http://www.w3.org/1999/xhtml}"
GLYPH_WIDTH = 0.5  # em: of every glyph of Tesseract's invisible font
MIN_SIZE = 1.0  # pixels


@dataclass(frozen=True)
class Word:
    """A word, and its left and right edge in pixels of the page."""

    text: str
    left: float
    right: float


@dataclass(frozen=True)
class Line:
    """Words from left to right.

    base, slope: the base line is y = base + slope·(x − left), y down.
    size: its height.
    """

    words: tuple[Word, ...]
    left: float
    base: float
    slope: float
    size: float

    def base_at(self, x: float) -> float:
        """Height of the base line at x, pixels from the top."""
        return self.base + self.slope * (x - self.left)


Paragraph = tuple[Line, ...]


def paragraphs_of(hocr: bytes, scale: float) -> tuple[Paragraph, ...]:
    """Return the paragraphs of an hOCR page, in pixels of the page itself.

    T. Breuel, "The hOCR Embedded OCR Workflow and Output Format", 1.2. Its picture was enlarged by scale.
    """
    root = ElementTree.fromstring(hocr)
    paragraphs = (tuple(_lines(par, scale)) for par in root.iter(f"{XHTML}p"))
    return tuple(lines for lines in paragraphs if lines)


def _lines(paragraph: ElementTree.Element, scale: float) -> Iterator[Line]:
    for element in paragraph:
        place = _properties(element)
        words = tuple(_words(element, scale))
        if not words:
            continue
        left, top, _, bottom = (value / scale for value in place["bbox"])
        slope, offset = place.get("baseline", (0.0, 0.0))
        yield Line(words, left, bottom + offset / scale, slope, max(bottom - top, MIN_SIZE))


def _words(line: ElementTree.Element, scale: float) -> Iterator[Word]:
    for element in line.iter(f"{XHTML}span"):
        text = "".join(element.itertext()).strip()
        if element.get("class") == "ocrx_word" and text:
            left, _, right, _ = (value / scale for value in _properties(element)["bbox"])
            yield Word(text, left, max(right, left + MIN_SIZE))


def _properties(element: ElementTree.Element) -> dict[str, tuple[float, ...]]:
    """Numbers of the title of an hOCR element by their names."""
    properties = {}
    for part in element.get("title", "").split(";"):
        name, *values = part.split()
        if values and all(re.fullmatch(r"-?\d+(\.\d+)?", value) for value in values):
            properties[name] = tuple(float(value) for value in values)
    return properties


def content_of(paragraphs: Sequence[Paragraph], height: float, font: str) -> bytes:
    """Encode the words, invisible, as a content stream.

    In pixels of a page of some height; paragraph k has the mark k. Every word ends where its print ends; one space
    fills the gap to the next word of the line.
    """
    operators = []
    for number, lines in enumerate(paragraphs):
        operators += [f"/P <</MCID {number}>> BDC", "BT", "3 Tr"]
        for line in lines:
            operators += [f"{font} {line.size:.3f} Tf", *_runs(line, height)]
        operators += ["ET", "EMC"]
    return "\n".join(operators).encode()


def _runs(line: Line, height: float) -> Iterator[str]:
    for word, following in zip(line.words, [*line.words[1:], None], strict=True):
        y = height - line.base_at((word.left + word.right) / 2)
        yield _run(word.text, word.left, word.right, y, line.size)
        if following is None:
            yield _run(" ", word.right, word.right + GLYPH_WIDTH * line.size, y, line.size)
        elif following.left > word.right:
            yield _run(" ", word.right, following.left, y, line.size)


def _run(text: str, left: float, right: float, y: float, size: float) -> str:
    """Return one run of text from left to right in the glyphs of a font with codes of UTF-16."""
    codes = text.encode("utf-16-be")
    stretch = 100 * (right - left) / (len(codes) / 2 * GLYPH_WIDTH * size)
    return f"{stretch:.3f} Tz 1 0 0 1 {left:.3f} {y:.3f} Tm <{codes.hex().upper()}> Tj"
