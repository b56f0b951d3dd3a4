"""Read the words of restored pages: from the pages' files to text, ALTO and PDF/A."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from restore import BadInput, read_bytes
from station.export.atomic import refuse_existing, writable, write_all
from station.export.pdf import encode_pdf
from station.pages import find_pages, read_page
from station.precision import Reading, read_characters, read_words
from station.progress import Progress, silent
from station.words import find_tesseract, recognise

ENDINGS = (".txt", "-alto.xml", ".hocr", ".pdf")


@dataclass(frozen=True)
class PageRead:
    """A page, the files that hold its words, how many these are; and how well it was read, where that is known."""

    page: Path
    files: tuple[Path, ...]
    count: int
    words: Reading | None = None
    characters: Reading | None = None


def read_pages(
    source: Path,
    folder: Path | None = None,
    *,
    language: str = "eng",
    truth: Path | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Iterator[PageRead]:
    """Read a page or a folder of results, and write what was read to `folder`, beside the page when None.

    truth: a text file of what is printed on the page, to measure against.
    Raises ProgramMissing, UsageError, OverwriteError and BadInput before any page is read; StationError when Tesseract
    fails, OSError when the disk refuses.
    """
    find_tesseract()
    pages = find_pages(source)
    printed = None if truth is None else _text(truth)
    if printed is not None and len(pages) > 1:
        raise BadInput(f"{source} holds {len(pages)} pages, and the truth is about one", "give the page's own file")
    targets = [[(folder or page.parent) / (page.stem + ending) for ending in ENDINGS] for page in pages]
    refuse_existing([path for paths in targets for path in paths], force=force)
    for i, (page, paths) in enumerate(zip(pages, targets, strict=True)):
        progress("ocr", i / len(pages))
        yield _read(page, paths, printed, language=language, force=force)
    progress("ocr", 1.0)


def _read(page: Path, paths: list[Path], printed: str | None, *, language: str, force: bool) -> PageRead:
    stored = read_page(page)
    with writable(paths[0].parent) as claim:
        words = recognise(stored.image, stored.dpi, name=page.name, language=language)
        pdf = encode_pdf(stored.image, stored.dpi, words, title=page.stem, profile=stored.profile)
        files = write_all(
            zip(paths, (words.text.encode(), words.alto, words.hocr, pdf), strict=True), force=force, claim=claim
        )
    measured = () if printed is None else (read_words(printed, words.text), read_characters(printed, words.text))
    return PageRead(page, tuple(files), len(words.text.split()), *measured)


def summary_line(read: PageRead) -> str:
    """What was read, in a few lines for people."""
    lines = [f"{'page':<10} {read.page}", f"{'read':<10} {read.count} words"]
    for name, reading in (("words", read.words), ("characters", read.characters)):
        if reading is not None:
            lines.append(f"{name:<10} {reading.precision:.1%} right: {reading.right} of {reading.of}")
    return "\n".join([*lines, *(f"{'file':<10} {path}" for path in read.files)])


def _text(path: Path) -> str:
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise BadInput(f"{path} is no text: {error}", "give a text file in UTF-8") from error
