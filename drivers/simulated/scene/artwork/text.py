"""Pages of running text, with every word's place."""

from __future__ import annotations

from itertools import cycle
from typing import Annotated, ClassVar, Literal

import numpy as np
from PIL import Image
from pydantic import Field

from drivers.simulated.scene.artwork.printed import DPI, Gloss, Print, Word, blank
from drivers.simulated.scene.artwork.typeset import Column, Face
from drivers.simulated.scene.sheets.sheet import PageSize, parameters

TITLE = "On the Making of Paper"
SENTENCES = (
    "Rags were sorted by hand, and only the whitest linen went into the finest sheets.",
    "The vat was kept just warm enough for the fibres to part without losing their length.",
    "A skilled worker dipped the mould twice a minute from morning until the light failed.",
    "Water drained through the wires and left behind a film no thicker than a leaf.",
    "Between two felts the young sheet could be pressed before it was strong enough to hold.",
    "Every press turned the stack a little drier and the paper a little more even.",
    "In the loft the sheets hung over ropes of horse hair for eight days or more.",
    "Damp weather made them swell along one edge, and that edge dried into a wave.",
    "Size made from hide was brushed on while the room was still cool.",
    "Without it the ink would spread, and a fine letter would grow a beard.",
    "Printers wetted the paper again, because a soft sheet takes the type more deeply.",
    "The binder folded each printed sheet three times and sewed it through the back.",
    "A thick volume never opens flat, and its inner margins fall into the gutter.",
    "Maps were folded twice across and once along, so that they fitted a coat pocket.",
    "Letters that had been rolled for a journey kept their curl for a hundred years.",
    "The careless reader crumples a page in a second, and no iron makes it whole.",
    "Every crease breaks some fibres, yet the sheet keeps its length from end to end.",
    "That is why a bent page can be laid out again as it was printed.",
    "Whoever measures its surface well enough can read it without touching it at all.",
    "Zinc plates, jute sacks and quick lime had their own shelf beside the mixing vat.",
)

BOLD: dict[str, Face] = {"serif": "serif-bold", "sans": "sans-bold"}
Size = Annotated[float, Field(ge=4, le=72)]


@parameters
class Text:
    """A title and paragraphs in several sizes of type, until the page is full.

    title_pt  size of the title.
    sizes_pt  sizes of the paragraphs in turn; the last fills the rest of the page.
    face      "serif" or "sans".
    columns   1 or 2.
    margin_mm on all four sides.
    seed      order of the sentences.
    dpi       of the print; an office printer's unless a camera sees more.
    """

    name: ClassVar[str] = "text"
    title_pt: Size = 28.0
    sizes_pt: Annotated[tuple[Size, ...], Field(min_length=1)] = (20.0, 16.0, 14.0, 12.0)
    face: Literal["serif", "sans"] = "serif"
    columns: Annotated[int, Field(ge=1, le=2)] = 1
    margin_mm: Annotated[float, Field(ge=0, le=60)] = 15.0
    seed: Annotated[int, Field(ge=0)] = 0
    gloss: Gloss = 0.0
    dpi: Annotated[int, Field(ge=100, le=1200)] = DPI

    def print_on(self, page_mm: PageSize) -> Print:
        """Print sentences in random order: one paragraph of three for each size of type."""
        rng = np.random.default_rng(self.seed)
        sentences = cycle(rng.permutation(SENTENCES))
        picture = Image.fromarray(blank(page_mm, self.dpi))
        words: list[Word] = []
        sizes = list(self.sizes_pt)
        for i, column in enumerate(self._columns(picture, page_mm)):
            if i == 0:
                words += column.set(TITLE, self.title_pt, BOLD[self.face])
            while True:
                size = sizes.pop(0) if len(sizes) > 1 else sizes[0]
                placed = list(column.set(" ".join(next(sentences) for _ in range(3)), size, self.face))
                if not placed:
                    break
                words += placed
                column.skip(size / 2)
        return Print(np.asarray(picture), page_mm, gloss=self.gloss, words=tuple(words), dpi=self.dpi)

    def _columns(self, picture: Image.Image, page_mm: PageSize) -> list[Column]:
        width, height = (side / 25.4 * self.dpi for side in page_mm)
        margin, gap = self.margin_mm / 25.4 * self.dpi, self.dpi / 4  # a quarter of an inch between columns
        step = (width - 2 * margin + gap) / self.columns
        return [
            Column(picture, page_mm, left, left + step - gap, margin, height - margin, self.dpi)
            for left in (margin + i * step for i in range(self.columns))
        ]
