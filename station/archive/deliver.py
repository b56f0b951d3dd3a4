"""A volume written to a new folder in one of the formats: whole, or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np

from restore import BadInput, RangeScan, SurfaceMesh
from station.archive import iiif
from station.archive.alto import with_placed_words
from station.archive.bag import MANIFEST, PAYLOAD, manifest, seal_bag
from station.archive.book import Leaf, write_book
from station.archive.formats import Format
from station.archive.iiif import PageImage, encode_info, encode_manifest, encode_tiles
from station.archive.mets import encode_mets
from station.archive.mix import read_image_facts
from station.archive.names import file_names
from station.archive.sheets import encode_sheet, surface_of
from station.archive.table import NAME as TABLE
from station.archive.table import encode_table
from station.archive.tiff import encode_master
from station.archive.trim import own_box_of
from station.archive.volume import Page, Role, StoredFile, Volume, missing
from station.choices import Sheets
from station.images.image_metadata import software
from station.images.pages import StoredPage, read_page
from station.progress import Progress, silent
from station.run.pieces import select_sheets
from station.session.log.store import file_digest
from station.storage.atomic import lock_output_folder, new_folder, refuse_captured
from station.storage.disk import copy_file, write_file

METS_NAME, BY_NUMBER = "mets.xml", "number"
TAKEN = "an export is a new folder: choose another name with -o"
NOTHING = "restore pages of the session first: planish batch"


Source = Callable[[Page], RangeScan | SurfaceMesh]


@dataclass(frozen=True)
class Delivery:
    """What was written, and a line for everything that the volume lacks."""

    folder: Path
    files: int
    missing: tuple[str, ...]


# What each page should have.
WANTED = {
    Format.BAGIT: (Role.ORIGINAL, Role.PAGE),
    Format.METS: (Role.ORIGINAL, Role.PAGE, Role.WORDS),
    Format.IIIF: (Role.PAGE,),
    Format.PDF: (Role.PAGE, Role.WORDS),
    Format.TIFF: (Role.PAGE,),
    Format.MESH: (Role.ORIGINAL,),
}


def deliver(
    volume: Volume,
    kind: Format,
    out: Path,
    *,
    address: str = "",
    now: datetime,
    source: Source | None = None,
    names: str = BY_NUMBER,
    trim: bool = False,
    progress: Progress = silent,
) -> Delivery:
    """Write a volume to the new folder `out`.

    address  of the web folder that an IIIF export is served from.
    source   gives the scan of a page, for meshes.
    names    of TIFF files and meshes, as of `file_names`.
    trim     leave out the strip of the facing page, in images and in a PDF.
    Raises OverwriteError when something is there, BadInput when there is nothing to write or a file of the volume is
    damaged, OSError when the disk refuses; then nothing is left.
    """
    lacks = missing(volume, *WANTED[kind])
    stems = file_names(volume, names)
    refuse_captured([out], TAKEN)
    with lock_output_folder(out.parent) as lock, new_folder(lock, out.name, hint=TAKEN) as folder:
        folder.mkdir(parents=True)
        for done, (name, content) in enumerate(_files(volume, kind, address, source, now, stems, trim)):
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            content(path)
            progress("export", min(done / max(_expected(volume, kind), 1), 1.0))
        count = sum(path.is_file() for path in folder.rglob("*"))
        if not count:
            raise BadInput(f"{volume.title}: there is nothing to export: {'; '.join(lacks)}", NOTHING)
        if kind is Format.BAGIT:
            seal_bag(folder, _bag_info(volume, now, lacks))
        else:
            everything = sorted(path for path in folder.rglob("*") if path.is_file())
            write_file(folder / MANIFEST, manifest(folder, everything))
    progress("export", 1.0)
    return Delivery(out, count, tuple(lacks))


Content = Callable[[Path], object]
"""Writes the content of a file to a path."""


def _files(
    volume: Volume,
    kind: Format,
    address: str,
    source: Source | None,
    now: datetime,
    stems: Mapping[int, str],
    trim: bool,
) -> Iterator[tuple[str, Content]]:
    match kind:
        case Format.BAGIT:
            return ((f"{PAYLOAD}/{name}", content) for name, content in _mets(volume, now))
        case Format.METS:
            return _mets(volume, now)
        case Format.IIIF:
            return _listed(volume, _iiif(volume, address, trim=trim))
        case Format.PDF:
            return _listed(volume, _pdf(volume, trim=trim))
        case Format.TIFF:
            return _listed(volume, _tiff(volume, stems, trim=trim))
        case Format.MESH:
            return _mesh(volume, source, stems)


def _listed(volume: Volume, files: Iterator[tuple[str, Content]]) -> Iterator[tuple[str, Content]]:
    """Yield files, and after them the table of the pages."""
    written = False
    for file in files:
        written = True
        yield file
    if written:
        yield TABLE, _written(encode_table(volume))


def _mets(volume: Volume, now: datetime) -> Iterator[tuple[str, Content]]:
    """Every file of the volume, and the document that holds them together."""
    volume, images = with_placed_words(volume, now), {}
    for file in volume.files:
        yield file.name, _copy_of(file)
        if file.media_type.startswith("image/"):
            images[file.name] = read_image_facts(file.path)
    if next(volume.files, None) is not None:
        yield METS_NAME, _written(encode_mets(volume, images, now=now))
        yield TABLE, _written(encode_table(volume))


def _copy_of(file: StoredFile) -> Content:
    """Copies a file, and compares it with its digest. Raises BadInput when it is damaged."""
    if file.made is not None:
        made = file.made
        return lambda path: write_file(path, made())

    def copy(path: Path) -> None:
        copy_file(file.path, path)
        if file_digest(path) != file.sha512:
            raise BadInput(f"{file.path} is damaged: its digest has changed", "see planish verify")

    return copy


def _iiif(volume: Volume, address: str, *, trim: bool) -> Iterator[tuple[str, Content]]:
    images = []
    for page, file in _restored(volume):
        stored = _shown(page, file, trim=trim)
        height, width = stored.image.shape[:2]
        image = PageImage(page, f"{iiif.IMAGES}/{page.number:04}", width, height, stored.dpi)
        images.append(image)
        for name, data in encode_tiles(stored.image, stored.profile):
            yield f"{image.folder}/{name}", _written(data)
        yield f"{image.folder}/info.json", _written(encode_info(f"{address}/{image.folder}", width, height))
    if images:
        yield iiif.MANIFEST, _written(encode_manifest(volume, images, address))


def _pdf(volume: Volume, *, trim: bool) -> Iterator[tuple[str, Content]]:
    leaves, places = [], dict[int, int]()
    for place, (page, file) in enumerate(_restored(volume), 1):
        words = page.find(Role.PDF)
        box = own_box_of(page, file) if trim else None
        leaves.append(Leaf(page.label, file.path, None if words is None else words.path, box))
        places[page.number] = place
    shown = [replace(one, pages=tuple(places[page] for page in one.pages if page in places)) for one in volume.sections]
    sections = [one for one in shown if one.pages]
    title, about = volume.shown_title, volume.about
    if leaves:
        yield "volume.pdf", lambda path: write_book(leaves, path, title=title, about=about, sections=sections)


def _tiff(volume: Volume, stems: Mapping[int, str], *, trim: bool) -> Iterator[tuple[str, Content]]:
    for page in volume.pages:
        file = page.find(Role.MASTER, Role.PAGE)
        if file is not None:
            yield f"{stems[page.number]}.tif", _written(encode_master(page, _shown(page, file, trim=trim)))


def _shown(page: Page, file: StoredFile, *, trim: bool) -> StoredPage:
    """Return the image of a page, without the strip of the facing page where that is trimmed."""
    stored = read_page(file.path)
    box = own_box_of(page, file) if trim else None
    if box is None:
        return stored
    left, top, right, bottom = box
    return replace(stored, image=np.ascontiguousarray(stored.image[top:bottom, left:right]))


def _mesh(volume: Volume, source: Source | None, stems: Mapping[int, str]) -> Iterator[tuple[str, Content]]:
    """Write the sheet of each scan, with the name of its first leaf."""
    done = set[str]()
    for page in volume.pages:
        original = page.find(Role.ORIGINAL)
        if source is None or original is None or original.name in done:
            continue
        done.add(original.name)
        (found, *_) = select_sheets(source(page), Sheets.LARGEST)
        area = None if found.sheet is None else found.sheet.area  # without the table below it
        for name, data in encode_sheet(surface_of(found.scan, area), stems[page.number]):
            yield name, _written(data)


def _restored(volume: Volume) -> Iterable[tuple[Page, StoredFile]]:
    return ((page, file) for page in volume.pages if (file := page.find(Role.PAGE)) is not None)


def _written(data: bytes) -> Content:
    return lambda path: write_file(path, data)


def _expected(volume: Volume, kind: Format) -> int:
    """About how many files there will be."""
    if kind in (Format.BAGIT, Format.METS):
        return sum(1 for _ in volume.files)
    return len(volume.pages) * {Format.IIIF: 60, Format.MESH: 5}.get(kind, 1)


def _bag_info(volume: Volume, now: datetime, lacks: list[str]) -> dict[str, str]:
    """The reserved elements of RFC 8493, 2.2.2, that are known."""
    return {
        "Source-Organization": volume.organisation,
        "External-Identifier": volume.identifier,
        "External-Description": volume.title,
        "Bag-Group-Identifier": volume.project,
        "Bagging-Date": now.date().isoformat(),
        "Bag-Software-Agent": software(),
        "Internal-Sender-Description": f"incomplete: {'; '.join(lacks)}" if lacks else "complete",
    }
