"""`planish card`: the scale card to print, as PDF."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.commands.options import Debug, Force, output_path, require_suffix
from station.commands.terminal import print_result, report_faults

if TYPE_CHECKING:
    from restore import ScaleCard

POINTS_PER_MM = 72 / 25.4
SHEET_MM = (210.0, 279.0)  # fits on A4 and on Letter paper
TOP_MM = 30.0  # of the card below the upper edge of the sheet: printers' margins are narrower
RULER_MM = 100.0
RULER_GAP_MM = 14.0  # from the card to the line under it, which is measured and cut off
TICK_MM = 3.0
TEXT_PT, LEADING = 10, 1.4
INSTRUCTIONS = (
    "Print at 100 %, without scaling. The line above is 100 mm long: measure it.",
    "Cut the strip out, or leave the sheet whole. Put it flat next to the page, fully in view,",
    "and do not move it or the page from the first photograph to the last.",
)


def card(
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="PDF", help="File to write.", show_default=False, parser=output_path),
    ],
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Draw the printable scale card for photographs (PDF).

    Print the card at 100 % and put it next to the page.
    """
    with report_faults(debug=debug):
        from restore import ScaleCard
        from station.storage.atomic import write_all

        require_suffix(output, ".pdf")
        write_all([(output, encode_card(ScaleCard()))], force=force)
        print_result(f"{output}: print it at 100 %, and put it next to the page for `planish photos`")


def encode_card(card: ScaleCard) -> bytes:
    """Encode a PDF of one sheet with the card in its true size.

    Drawn as rectangles, with a line to check the printer by.
    """
    import pikepdf

    name = pikepdf.Name
    width, height = (side * POINTS_PER_MM for side in SHEET_MM)
    font = pikepdf.Dictionary(Type=name.Font, Subtype=name.Type1, BaseFont=name.Helvetica)
    out = io.BytesIO()
    with pikepdf.new() as pdf:
        page = pikepdf.Dictionary(
            Type=name.Page,
            MediaBox=pikepdf.Array([0, 0, round(width, 4), round(height, 4)]),
            Resources=pikepdf.Dictionary(Font=pikepdf.Dictionary(Text=pdf.make_indirect(font))),
            Contents=pdf.make_stream("\n".join(_operators(card)).encode("ascii")),
        )
        pdf.pages.append(pikepdf.Page(pdf.make_indirect(page)))
        # Readers that heed it do not shrink the sheet to the printer's margins (ISO 32000-1, 12.2).
        pdf.Root.ViewerPreferences = pikepdf.Dictionary(PrintScaling=name("/None"))
        pdf.save(out, deterministic_id=True)
    return out.getvalue()


def _operators(card: ScaleCard) -> Iterator[str]:
    """The drawing of the sheet, in millimetres from its lower left corner."""
    width, height = card.size_mm
    left, bottom = (SHEET_MM[0] - width) / 2, SHEET_MM[1] - TOP_MM - height
    yield f"q {POINTS_PER_MM:.8f} 0 0 {POINTS_PER_MM:.8f} 0 0 cm"
    yield f"0.7 G 0.1 w {left:.4f} {bottom:.4f} {width:.4f} {height:.4f} re S"
    yield "0 g"
    middle = left + width / 2, bottom + height / 2
    for marker, (x, y) in enumerate(card.centres):
        yield from _marker(card, marker, middle[0] + x, middle[1] + y)
    ruler = bottom - RULER_GAP_MM
    start = (SHEET_MM[0] - RULER_MM) / 2
    yield f"0 G 0.2 w {start:.4f} {ruler:.4f} m {start + RULER_MM:.4f} {ruler:.4f} l S"
    for end in (start, start + RULER_MM):
        yield f"{end:.4f} {ruler - TICK_MM:.4f} m {end:.4f} {ruler + TICK_MM:.4f} l S"
    yield f"Q BT /Text {TEXT_PT} Tf {TEXT_PT * LEADING:.3f} TL"
    yield f"{left * POINTS_PER_MM:.3f} {(ruler - 4 * TICK_MM) * POINTS_PER_MM:.3f} Td"
    yield from (f"({line}) ' " for line in INSTRUCTIONS)
    yield "ET"


def _marker(card: ScaleCard, marker: int, x: float, y: float) -> Iterator[str]:
    """Yield the operators of a black square with its white cells.

    Those of a row that touch are one: no hairlines appear between them.
    """
    ink = card.ink(marker)
    cell = card.marker_mm / len(ink)
    left, top = x - card.marker_mm / 2, y + card.marker_mm / 2
    yield f"0 g {left:.4f} {y - card.marker_mm / 2:.4f} {card.marker_mm:.4f} {card.marker_mm:.4f} re f 1 g"
    for row, cells in enumerate(ink):
        col = 0
        while col < len(cells):
            end = col
            while end < len(cells) and not cells[end]:
                end += 1
            if end > col:
                yield f"{left + col * cell:.4f} {top - (row + 1) * cell:.4f} {(end - col) * cell:.4f} {cell:.4f} re f"
            col = max(end, col + 1)
