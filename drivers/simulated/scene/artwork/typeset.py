"""Sets words in lines, and says where each came to stand."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Literal

from PIL import Image, ImageDraw, ImageFont

from drivers.simulated.scene.artwork.printed import BLACK, DPI, Word, box_mm
from drivers.simulated.scene.sheets.sheet import PageSize

Face = Literal["serif", "sans", "serif-bold", "sans-bold"]
LEADING = 1.35  # distance of base lines over size of type, usual for text faces


@dataclass
class Column:
    """A column of text that is filled from the top; positions in pixels of the picture."""

    picture: Image.Image
    page_mm: PageSize
    left: float
    right: float
    top: float
    bottom: float
    dpi: float = DPI

    def set(self, text: str, size_pt: float, face: Face) -> Iterator[Word]:
        """Draw a paragraph below the column's content, and yield its words.

        Words that do not fit are left out.
        """
        font = typeface(face, size_pt, self.dpi)
        pen = ImageDraw.Draw(self.picture)
        line = size_pt / 72 * self.dpi * LEADING
        for words in _lines(text.split(), font, self.right - self.left):
            if self.top + line > self.bottom:
                return
            base, x = self.top + line * 0.75, self.left
            for word in words:
                pen.text((round(x), round(base)), word, fill=BLACK, font=font, anchor="ls")
                ink = pen.textbbox((round(x), round(base)), word, font=font, anchor="ls")
                yield Word(word, box_mm(*ink, self.page_mm, self.dpi), size_pt)
                x += font.getlength(word + " ")
            self.top += line

    def skip(self, size_pt: float) -> None:
        """Leave a gap."""
        self.top += size_pt / 72 * self.dpi


def _lines(words: Iterable[str], font: ImageFont.FreeTypeFont, width: float) -> Iterator[list[str]]:
    line: list[str] = []
    for word in words:
        if line and font.getlength(" ".join([*line, word])) > width:
            yield line
            line = []
        line.append(word)
    if line:
        yield line


@cache
def typeface(face: Face, size_pt: float, dpi: float = DPI) -> ImageFont.FreeTypeFont:
    """Return Source Serif or Source Sans (SIL Open Font Licence) at a size on paper."""
    import font_source_sans_pro as sans
    import font_source_serif_pro as serif

    family, _, weight = face.partition("-")
    files, name = (
        (serif.font_files_ttf, "SourceSerifPro") if family == "serif" else (sans.font_files_ttf, "SourceSansPro")
    )
    # The basic layout engine sets the same everywhere; the other one depends on a library of the system.
    return ImageFont.truetype(
        files[name + weight.capitalize()], size_pt / 72 * dpi, layout_engine=ImageFont.Layout.BASIC
    )
