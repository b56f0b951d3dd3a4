"""A volume of three pages: one with words, one without, one that is only captured."""

from __future__ import annotations

import shutil
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from drivers.simulated.scene.artwork import Text
from restore import save_scan
from station.archive.volume import Event, Page, Role, StoredFile, Volume
from station.images.image_metadata import ImageMetadata
from station.images.png import encode_png
from station.page_files.pdf import encode_pdf
from station.session.log.store import file_digest
from station.words.words import recognise
from tests.station.conftest import curl_scan

DPI = 300.0  # of the artwork
NOW = datetime(2026, 3, 4, 5, 6, 7, tzinfo=UTC)
PROVENANCE = {"device": "VIVID 900", "lens": "MIDDLE", "time": "2026-03-04T05:00:00+00:00"}
STRANGE = "Blätter & <Übriges> №1"


def stored(path: Path, name: str, role: Role, event: str) -> StoredFile:
    return StoredFile(path, name, role, file_digest(path), path.stat().st_size, event)


def picture(seed: int) -> np.ndarray:
    return Text(title_pt=20, sizes_pt=(14.0,), margin_mm=5, seed=seed).print_on((70.0, 50.0)).image


def write_page(folder: Path, number: int, *, words: bool) -> list[StoredFile]:
    """The restored page and, where Tesseract is installed and it is asked for, its words."""
    image = picture(number)
    metadata = ImageMetadata.from_provenance(PROVENANCE)
    contents = {("page.png", Role.PAGE): encode_png(image, DPI, metadata)}
    if words and shutil.which("tesseract"):
        read = recognise(image, DPI, name="page.png")
        contents["page-alto.xml", Role.WORDS] = read.alto
        contents["page.txt", Role.TEXT] = read.text.encode()
        contents["page.pdf", Role.PDF] = encode_pdf(image, DPI, read, title="page")
    files = []
    for (name, role), data in contents.items():
        (folder / name).write_bytes(data)
        files.append(stored(folder / name, f"pages/{number:04}/restore/{name}", role, f"{number:06}"))
    return files


@pytest.fixture(scope="session")
def volume(tmp_path_factory: pytest.TempPathFactory) -> Volume:
    root = tmp_path_factory.mktemp("volume")
    pages, events = [], []
    for number, label in ((1, "1r"), (2, "1v"), (3, "2r")):
        folder = root / str(number)
        save_scan(curl_scan(), folder / "scan")
        names = sorted(path.name for path in (folder / "scan").iterdir())
        capture = f"{number + 100:06}"
        files = [
            stored(folder / "scan" / name, f"pages/{number:04}/original/scan/{name}", Role.ORIGINAL, capture)
            for name in names
        ]
        sources = tuple(file.name for file in files)
        events.append(Event(capture, "capture", NOW, "planish 0.1.0", "page", results=sources))
        if number < 3:
            made = write_page(folder, number, words=number == 1)
            results = tuple(file.name for file in made)
            parameters, facts = {"settings": {"dpi": DPI}}, {"strain": {"rms": 0.001}, "note": "a\x00b"}
            events.append(
                Event(f"{number:06}", "creation", NOW, "planish 0.1.0", "restore", sources, results, parameters, facts)
            )
            files += made
        pages.append(Page(number, label, tuple(files), "right" if number % 2 else "left", PROVENANCE))
    return Volume("urn:uuid:1", STRANGE, tuple(pages), tuple(events), NOW, "Fragments", "A library")
