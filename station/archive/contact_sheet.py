"""Draw all leaf sides of a session as small pictures on sheets of a PDF."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence

from PIL import Image, ImageDraw, ImageFont

from restore import BadInput
from station.images.pages import read_page
from station.session import Session
from station.session.corrections.layers import is_corrected
from station.session.derivation.parameters import outdated_pages
from station.session.leaves.leaf import Leaf, leaves_of, picture_of

DPI = 150
SHEET_PX = (1240, 1754)  # A4 upright
MARGIN, GAP, TEXT = 60, 16, 18  # px
LINES = 2  # of text under a picture
COLOURS = {"green": (46, 125, 50), "amber": (191, 120, 0), "red": (183, 28, 28), "": (110, 110, 110)}
MAX_COLUMNS = 20


def contact_sheet(session: Session, columns: int) -> bytes:
    """Return the sheets as a PDF.

    With picture, name, label, level of the check, and what was edited.
    Raises BadInput for a session without pages.
    """
    leaves, outdated = leaves_of(session), frozenset(outdated_pages(session))
    if not leaves:
        raise BadInput("the session has no pages", "capture some: planish capture")
    width = (SHEET_PX[0] - 2 * MARGIN + GAP) // columns - GAP
    height = width * 4 // 3 + LINES * (TEXT + 4)
    rows = max((SHEET_PX[1] - 2 * MARGIN + GAP) // (height + GAP), 1)
    font = ImageFont.load_default(TEXT)
    sheets = []
    for first in range(0, len(leaves), columns * rows):
        sheet = Image.new("RGB", SHEET_PX, "white")
        for place, leaf in enumerate(leaves[first : first + columns * rows]):
            row, column = divmod(place, columns)
            corner = MARGIN + column * (width + GAP), MARGIN + row * (height + GAP)
            _draw(sheet, corner, width, session, leaf, font, list(_remarks(session, leaf, outdated)))
        sheets.append(sheet)
    out = io.BytesIO()
    sheets[0].save(out, "PDF", resolution=DPI, save_all=True, append_images=sheets[1:], title=session.volume.title)
    return out.getvalue()


def _draw(
    sheet: Image.Image,
    corner: tuple[int, int],
    width: int,
    session: Session,
    leaf: Leaf,
    font: ImageFont.ImageFont | ImageFont.FreeTypeFont,
    remarks: Sequence[str],
) -> None:
    """Draw a leaf side: its picture, and two lines of text under it."""
    x, y = corner
    height, draw = width * 4 // 3, ImageDraw.Draw(sheet)
    level = leaf.level
    path = picture_of(session, leaf)
    if path is None:
        draw.rectangle((x, y, x + width, y + height), outline=COLOURS[""])
    else:
        picture = Image.fromarray(read_page(path).image)
        picture.thumbnail((width, height))
        sheet.paste(picture, (x + (width - picture.width) // 2, y + height - picture.height))
    draw.rectangle((x, y + height + 2, x + width, y + height + 4), fill=COLOURS[level])
    for line, text in enumerate((f"{leaf.name}  {leaf.label}".rstrip(), ", ".join(filter(None, (level, *remarks))))):
        draw.text((x, y + height + 6 + line * (TEXT + 2)), _fitting(text, width, font), fill="black", font=font)


def _remarks(session: Session, leaf: Leaf, outdated: frozenset[int]) -> Iterator[str]:
    yield leaf.kind
    if leaf.is_left_out:
        yield "left out"
    if is_corrected(session, leaf.page):
        yield "edited later" if leaf.page.number in outdated else "edited"


def _fitting(text: str, width: int, font: ImageFont.ImageFont | ImageFont.FreeTypeFont) -> str:
    """Cut a text to a width in pixels."""
    shown = text
    while shown and font.getlength(shown) > width:
        shown = shown[:-1]
    return shown
