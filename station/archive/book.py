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

from station.export.pdf import POINTS_PER_INCH, declare, draw_picture, picture_stream, tag_pages
from station.images.icc import srgb_profile
from station.images.pages import read_page
from station.storage.disk import add_path_to_errors

if TYPE_CHECKING:
    import pikepdf
    from _typeshed import ReadableBuffer

NO_LANGUAGE = "und"  # BCP 47, of a volume without words


@dataclass(frozen=True)
class Leaf:
    """Page of the PDF: its label, its picture, and its PDF/A with words.

    The PDF/A is None where it does not exist.
    """

    label: str
    picture: Path
    words: Path | None = None


def write_book(leaves: Sequence[Leaf], path: Path, *, title: str) -> None:
    """Write the PDF of a volume, one page in memory at a time.

    Raises BadInput for a picture that cannot be read, OSError that names `path` when the disk refuses.
    """
    import pikepdf

    with ExitStack() as stack:
        pdf = stack.enter_context(pikepdf.new())
        intent = pdf.make_stream(srgb_profile(), N=3)
        paragraphs, language = [], ""
        for leaf in leaves:
            if leaf.words is None:
                _add_picture(pdf, leaf.picture, intent)
                paragraphs.append(0)
                continue
            source = stack.enter_context(pikepdf.open(leaf.words))
            pdf.pages.extend(source.pages)
            paragraphs.append(_paragraphs(source))
            language = language or str(source.Root.get("/Lang", ""))
        tag_pages(pdf, paragraphs, language or NO_LANGUAGE)
        labels = [
            part
            for number, leaf in enumerate(leaves)
            for part in (number, pikepdf.Dictionary(P=pikepdf.String(leaf.label)))
        ]
        pdf.Root.PageLabels = pikepdf.Dictionary(Nums=pikepdf.Array(labels))
        declare(pdf, intent, title)
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


def _add_picture(pdf: pikepdf.Pdf, path: Path, intent: pikepdf.Object) -> None:
    """Add a page that is a picture without words."""
    import pikepdf

    stored = read_page(path)
    height, width = (pixels / stored.dpi * POINTS_PER_INCH for pixels in stored.image.shape[:2])
    page = pdf.add_blank_page(page_size=(round(width, 4), round(height, 4)))
    colours = intent if stored.profile is None else pdf.make_stream(stored.profile, N=3)
    picture = picture_stream(pdf, stored.image, colours)
    page.obj.Resources = pikepdf.Dictionary(XObject=pikepdf.Dictionary(Page=picture))
    page.obj.Contents = pdf.make_stream(draw_picture(width, height).encode())


def _paragraphs(pdf: pikepdf.Pdf) -> int:
    """The number of marked paragraphs of the only page of a PDF that `encode_pdf` made."""
    return len(pdf.Root.StructTreeRoot.ParentTree.Nums[1])
