"""One PDF/A-2b of a volume: pages at their true sizes.

They are labelled as in the volume; their words can be searched and copied.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, cast

import numpy as np

from station.archive.page_labels import label_ranges
from station.archive.volume import Section
from station.images.icc import srgb_profile
from station.images.pages import read_page
from station.page_files.pdf import POINTS_PER_INCH, declare, draw_picture, picture_stream, tag_pages
from station.session.terms.about import RTL, About
from station.storage.disk import add_path_to_errors

if TYPE_CHECKING:
    import pikepdf
    from _typeshed import ReadableBuffer

NO_LANGUAGE = "und"  # BCP 47, of a volume without words


Box = tuple[int, int, int, int]


@dataclass(frozen=True)
class Leaf:
    """Page of the PDF: its label, its picture, and its PDF/A with words.

    The PDF/A is None where it does not exist. box: left, top, right, bottom of what is shown, pixels; None for all.
    """

    label: str
    picture: Path
    words: Path | None = None
    box: Box | None = None


def write_book(
    leaves: Sequence[Leaf], path: Path, *, title: str, about: About | None = None, sections: Sequence[Section] = ()
) -> None:
    """Write the PDF of a volume, one page in memory at a time.

    sections: become its bookmarks. Their pages are numbers from 1 among the leaves.
    Raises BadInput for a picture that cannot be read, OSError that names `path` when the disk refuses.
    """
    import pikepdf

    with ExitStack() as stack:
        pdf = stack.enter_context(pikepdf.new())
        intent = pdf.make_stream(srgb_profile(), N=3)
        paragraphs, language = [], ""
        for leaf in leaves:
            if leaf.words is None:
                _add_picture(pdf, leaf, intent)
                paragraphs.append(0)
                continue
            source = stack.enter_context(pikepdf.open(leaf.words))
            pdf.pages.extend(source.pages)
            if leaf.box is not None:
                pdf.pages[-1].CropBox = _crop_box(pdf.pages[-1], leaf)
            paragraphs.append(_paragraphs(source))
            language = language or str(source.Root.get("/Lang", ""))
        tag_pages(pdf, paragraphs, language or NO_LANGUAGE)
        pdf.Root.PageLabels = _page_labels([leaf.label for leaf in leaves])
        _set_view(pdf, about or About(), sections)
        declare(pdf, intent, title, (about or About()).dublin_core())
        _save(pdf, path)


class _Sink(io.RawIOBase):
    """Stream that passes data on to a file until the disk refuses.

    It keeps the error: qpdf would abort the process for it.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.refusal: OSError | None = None

    def writable(self) -> bool:
        return True

    def write(self, data: ReadableBuffer) -> int:
        if self.refusal is None:
            try:
                self._file.write(data)
            except OSError as error:
                self.refusal = error
        return memoryview(data).nbytes


def _save(pdf: pikepdf.Pdf, path: Path) -> None:
    with add_path_to_errors(path), path.open("wb") as file:
        sink = _Sink(file)
        pdf.save(cast(BinaryIO, sink), deterministic_id=True, force_version="1.7")
        if sink.refusal is not None:
            raise sink.refusal


def _page_labels(labels: Sequence[str]) -> pikepdf.Object:
    """The labels of the pages as a number tree."""
    import pikepdf

    entries: list[int | pikepdf.Object] = []
    for one in label_ranges(labels):
        table: dict[str, pikepdf.Object | int] = {"/P": pikepdf.String(one.prefix)} if one.prefix else {}
        if one.style:
            table |= {"/S": pikepdf.Name(f"/{one.style}"), "/St": one.start}
        entries += [one.first, pikepdf.Dictionary(table)]
    return pikepdf.Dictionary(Nums=pikepdf.Array(entries))


def _set_view(pdf: pikepdf.Pdf, about: About, sections: Sequence[Section]) -> None:
    """Set reading direction, openings of two pages, and bookmarks."""
    import pikepdf

    if about.direction:
        direction = pikepdf.Name.R2L if about.direction == RTL else pikepdf.Name.L2R
        pdf.Root.ViewerPreferences = pikepdf.Dictionary(Direction=direction)
    if len(sections) > 1:
        pdf.Root.PageLayout = pikepdf.Name.TwoPageRight
        with pdf.open_outline() as outline:
            outline.root.extend(pikepdf.OutlineItem(one.label, one.pages[0] - 1) for one in sections)


def _crop_box(page: pikepdf.Page, leaf: Leaf) -> pikepdf.Object:
    """The box of what is shown of a page, in points from its lower left corner."""
    import pikepdf

    assert leaf.box is not None
    left, bottom, right, top = (float(side) for side in page.MediaBox)
    stored = read_page(leaf.picture)
    height, width = stored.image.shape[:2]
    across, up = (right - left) / width, (top - bottom) / height
    x0, y0, x1, y1 = leaf.box
    box = left + x0 * across, top - y1 * up, left + x1 * across, top - y0 * up
    return pikepdf.Array([round(side, 4) for side in box])


def _add_picture(pdf: pikepdf.Pdf, leaf: Leaf, intent: pikepdf.Object) -> None:
    """Add a page that is a picture without words."""
    import pikepdf

    stored = read_page(leaf.picture)
    left, top, right, bottom = leaf.box or (0, 0, *stored.image.shape[1::-1])
    image = np.ascontiguousarray(stored.image[top:bottom, left:right])
    height, width = (pixels / stored.dpi * POINTS_PER_INCH for pixels in image.shape[:2])
    page = pdf.add_blank_page(page_size=(round(width, 4), round(height, 4)))
    colours = intent if stored.profile is None else pdf.make_stream(stored.profile, N=3)
    picture = picture_stream(pdf, image, colours)
    page.obj.Resources = pikepdf.Dictionary(XObject=pikepdf.Dictionary(Page=picture))
    page.obj.Contents = pdf.make_stream(draw_picture(width, height).encode())


def _paragraphs(pdf: pikepdf.Pdf) -> int:
    """The number of marked paragraphs of the only page of a PDF that `encode_pdf` made."""
    return len(pdf.Root.StructTreeRoot.ParentTree.Nums[1])
