"""Table of the output files of a run; one module encodes each format."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from restore import RangeScan, RestoredPage, SurfaceMesh
from station.images.coverage import encode_coverage
from station.images.image_metadata import ImageMetadata
from station.images.png import encode_png, write_png
from station.images.tiff import encode_map, encode_uncertainty, write_tiff
from station.page_files.mesh import encode_flat, encode_material, encode_strain, encode_warped
from station.page_files.model import encode_model
from station.page_files.pdf import encode_pdf
from station.page_files.report import encode_report
from station.pictures.frames import Frame, frames_sheet
from station.pictures.review import review
from station.pictures.strain import strain_picture
from station.storage.disk import Contents

if TYPE_CHECKING:
    from station.words.words import Words

ALWAYS = frozenset({"page", "report"})


@dataclass(frozen=True, eq=False)
class Restoration:
    """One restored page, its source and its report.

    stem    first part of every file's name.
    page    the restored page.
    source  the scan.
    frames  steps of the flattening; empty unless they were requested.
    report  the page's report with what the station adds (JSON values only).
    words   recognised text; None unless it was requested.
    colours ICC profile of the page; None for sRGB.
    master_colours  ICC profile of the master; None for sRGB.
    """

    stem: str
    page: RestoredPage
    source: RangeScan | SurfaceMesh
    frames: Sequence[Frame]
    report: Mapping[str, Any]
    words: Words | None = None
    colours: bytes | None = None
    master_colours: bytes | None = None

    @property
    def metadata(self) -> ImageMetadata:
        """Metadata of the pictures of the page."""
        return ImageMetadata.from_provenance(self.source.provenance, self.colours)

    @property
    def master_metadata(self) -> ImageMetadata:
        """Metadata of the master."""
        return ImageMetadata.from_provenance(self.source.provenance, self.master_colours)


@dataclass(frozen=True)
class Output:
    """File of a run.

    kind is what the operator asks for, the name is the stem and the suffix.
    """

    kind: str
    suffix: str
    encode: Callable[[Restoration], Contents]
    needs_colour: bool = False


def _words(done: Restoration) -> Words:
    assert done.words is not None
    return done.words


def _pdf(done: Restoration) -> bytes:
    return encode_pdf(done.page.image, done.page.dpi, _words(done), title=done.stem, profile=done.colours)


def _texture(done: Restoration) -> bytes:
    assert done.page.flat.texture is not None
    return encode_png(done.page.flat.texture)


def _written(write: Callable[..., None], name: str, done: Restoration) -> Contents:
    """Return what writes a picture of the page, by its rows."""
    metadata = done.metadata if name == "image" else done.master_metadata
    return partial(write, done.page.by_rows(name), done.page.dpi, metadata)


def _uncertainty(done: Restoration) -> bytes:
    assert done.page.uncertainty is not None
    return encode_uncertainty(done.page.uncertainty, done.page.dpi)


OUTPUTS = (
    Output("page", ".png", partial(_written, write_png, "image")),
    Output("master", "-master.png", partial(_written, write_png, "master"), needs_colour=True),
    Output("uncropped", "-uncropped.png", partial(_written, write_png, "uncropped"), needs_colour=True),
    Output("coverage", "-coverage.png", lambda done: encode_coverage(done.page.coverage, done.page.dpi)),
    Output("uncertainty", "-uncertainty.tif", _uncertainty),
    Output("tiff", ".tif", partial(_written, write_tiff, "image")),
    Output("map", "-map.tif", lambda done: encode_map(done.page)),
    Output("mesh", "-flat.obj", lambda done: encode_flat(done.page.flat, f"{done.stem}-mesh.mtl")),
    Output("mesh", "-warped.obj", lambda done: encode_warped(done.page.flat, f"{done.stem}-mesh.mtl")),
    Output("mesh", "-strain.ply", lambda done: encode_strain(done.page.fine)),
    Output("mesh", "-mesh.mtl", lambda done: encode_material(f"{done.stem}-texture.png"), needs_colour=True),
    Output("mesh", "-texture.png", _texture, needs_colour=True),
    Output("model", "-model.plm", lambda done: encode_model(done.page, done.frames)),
    Output("strain", "-strain.png", lambda done: encode_png(strain_picture(done.page))),
    Output("frames", "-frames.png", lambda done: encode_png(frames_sheet(done.frames, done.page.flat))),
    Output("review", "-review.png", lambda done: encode_png(review(done.page, done.source.texture))),
    Output("ocr", ".txt", lambda done: _words(done).text.encode()),
    Output("ocr", "-alto.xml", lambda done: _words(done).alto),
    Output("ocr", ".hocr", lambda done: _words(done).hocr),
    Output("ocr", ".pdf", _pdf),
    Output("report", ".json", lambda done: encode_report(done.report).encode()),  # last: it marks a complete run
)

OPTIONAL = ("uncertainty", "uncropped")  # kinds that are fields of a page, None where it has no contents for them
KINDS = frozenset(output.kind for output in OUTPUTS)


def names(stem: str, kinds: frozenset[str], page: RestoredPage | None = None) -> list[str]:
    """Names of the files that a run writes, of a page only those that it has contents for."""
    return [stem + output.suffix for output in _wanted(kinds, page)]


def encode_outputs(done: Restoration, kinds: frozenset[str]) -> Iterator[Contents]:
    """The contents of the files of `names`, made one at a time."""
    return (output.encode(done) for output in _wanted(kinds, done.page))


def _wanted(kinds: frozenset[str], page: RestoredPage | None) -> list[Output]:
    wanted = [out for out in OUTPUTS if out.kind in kinds | ALWAYS]
    if page is None:
        return wanted
    colour, missing = page.flat.texture is not None, {kind for kind in OPTIONAL if kind not in page.pictures}
    return [out for out in wanted if out.kind not in missing and (colour or not out.needs_colour)]
