"""PDF/A of a page: its picture and under it the words, invisible.

The picture is without loss at its true size; the words can be searched and copied. Level 2b (ISO 19005-2): output
intent and profile, metadata in XMP alone, fonts embedded (Tesseract embeds the one that it sets its invisible words
in), a file identifier, no encryption, no scripts.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from restore.scan import Bytes
from station.images.icc import srgb_profile
from station.images.image_metadata import software
from station.images.png import encode_png
from station.words.text_layer import content_of

if TYPE_CHECKING:
    import pikepdf

    from station.words.words import Words

POINTS_PER_INCH = 72
PNG_PREDICTOR = 15  # rows are stored as PNG stores them (ISO 32000-1, table 10)
PNG_SIGNATURE = 8
SRGB = "sRGB IEC61966-2.1"
NOTHING: Mapping[str, str | list[str] | set[str]] = {}


def encode_pdf(image: Bytes, dpi: float, words: Words, *, title: str, profile: bytes | None = None) -> bytes:
    """Encode a page (h, w, 3) uint8 RGB as tagged PDF/A-2b.

    Its words are in paragraphs, its picture is an artifact.
    profile: the ICC profile of the picture's colours, sRGB when None.
    """
    import pikepdf

    height, width = (pixels / dpi * POINTS_PER_INCH for pixels in image.shape[:2])
    with pikepdf.open(io.BytesIO(words.layer)) as pdf:
        page = pdf.pages[0]
        intent = pdf.make_stream(srgb_profile(), N=3)
        colours = intent if profile is None else pdf.make_stream(profile, N=3)
        page.Resources.XObject = pikepdf.Dictionary(Page=picture_stream(pdf, image, colours))
        page.MediaBox = pikepdf.Array([0, 0, round(width, 4), round(height, 4)])
        picture = draw_picture(width, height)
        point = POINTS_PER_INCH / dpi
        fonts = list(page.Resources.get("/Font", pikepdf.Dictionary()).keys())
        paragraphs = words.paragraphs if fonts else ()
        text = content_of(paragraphs, image.shape[0], str(fonts[0]) if fonts else "")
        draw = f"{picture}q {point:.6f} 0 0 {point:.6f} 0 0 cm\n".encode() + text + b"\nQ\n"
        page.Contents = pdf.make_stream(draw)
        tag_pages(pdf, [len(paragraphs)], words.language)
        declare(pdf, intent, title)
        out = io.BytesIO()
        pdf.save(out, deterministic_id=True, force_version="1.7")
    return out.getvalue()


def draw_picture(width: float, height: float) -> str:
    """Return the operators that draw the picture `Page` on all of a page, as an artifact.

    The size is in points.
    """
    return f"/Artifact BMC\nq {width:.4f} 0 0 {height:.4f} 0 0 cm /Page Do Q\nEMC\n"


def picture_stream(pdf: pikepdf.Pdf, image: Bytes, colours: pikepdf.Object) -> pikepdf.Stream:
    """Return a picture as the compressed stream of a PNG file.

    PDF stores rows in the same way.
    image: (h, w, 3) uint8 RGB.
    """
    import pikepdf

    height, width = image.shape[:2]
    picture = pikepdf.Stream(pdf, b"".join(_chunks(encode_png(image), b"IDAT")))
    rows = pikepdf.Dictionary(Predictor=PNG_PREDICTOR, Colors=3, BitsPerComponent=8, Columns=width)
    picture.stream_dict = pikepdf.Dictionary(
        Type=pikepdf.Name.XObject,
        Subtype=pikepdf.Name.Image,
        Width=width,
        Height=height,
        BitsPerComponent=8,
        ColorSpace=pikepdf.Array([pikepdf.Name.ICCBased, colours]),
        Filter=pikepdf.Name.FlateDecode,
        DecodeParms=rows,
    )
    return picture


def tag_pages(pdf: pikepdf.Pdf, paragraphs: Sequence[int], language: str) -> None:
    """Give the marked paragraphs of every page a structure and a language.

    ISO 32000-1, 14.7.
    paragraphs: their number on each page.
    """
    import pikepdf

    name = pikepdf.Name
    root = pdf.make_indirect(pikepdf.Dictionary(Type=name.StructTreeRoot))
    document = pdf.make_indirect(pikepdf.Dictionary(Type=name.StructElem, S=name.Document, P=root))
    elements: list[pikepdf.Object] = []
    parents: list[int | pikepdf.Object] = []
    for number, (page, count) in enumerate(zip(pdf.pages, paragraphs, strict=True)):
        children = [
            pdf.make_indirect(pikepdf.Dictionary(Type=name.StructElem, S=name.P, P=document, Pg=page.obj, K=mark))
            for mark in range(count)
        ]
        elements += children
        parents += [number, pikepdf.Array(children)]
        page.obj.StructParents = number
    document.K = pikepdf.Array(elements)
    root.K = document
    root.ParentTree = pdf.make_indirect(pikepdf.Dictionary(Nums=pikepdf.Array(parents)))
    root.ParentTreeNextKey = len(paragraphs)
    pdf.Root.StructTreeRoot = root
    pdf.Root.MarkInfo = pikepdf.Dictionary(Marked=True)
    pdf.Root.Lang = pikepdf.String(language)


def declare(
    pdf: pikepdf.Pdf, intent: pikepdf.Object, title: str, described: Mapping[str, str | list[str] | set[str]] = NOTHING
) -> None:
    """Declare conformance to PDF/A-2b, the output intent and the title.

    described: further elements of Dublin Core, by their names in XMP.
    """
    import pikepdf

    pdf.Root.OutputIntents = pikepdf.Array(
        [
            pikepdf.Dictionary(
                Type=pikepdf.Name.OutputIntent,
                S=pikepdf.Name.GTS_PDFA1,
                OutputConditionIdentifier=SRGB,
                Info=SRGB,
                DestOutputProfile=intent,
            )
        ]
    )
    del pdf.docinfo  # its entries would have to be repeated in XMP: XMP alone suffices
    with pdf.open_metadata(set_pikepdf_as_editor=False, update_docinfo=False) as metadata:
        metadata["dc:title"] = title
        for name, value in described.items():
            metadata[name] = value
        metadata["xmp:CreatorTool"] = software()
        metadata["pdfaid:part"], metadata["pdfaid:conformance"] = "2", "B"


def _chunks(png: bytes, kind: bytes) -> Iterator[bytes]:
    at = PNG_SIGNATURE
    while at < len(png):
        length, name = struct.unpack_from(">I4s", png, at)
        if name == kind:
            yield png[at + 8 : at + 8 + length]
        at += 12 + length
