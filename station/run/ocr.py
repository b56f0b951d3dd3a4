"""Text recognition of stored pages: text, ALTO, hOCR and PDF/A files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from restore import BadInput, Finding
from restore.formats import read_bytes
from station.images.pages import find_pages, read_page
from station.page_files.pdf import encode_pdf
from station.progress import Progress, silent
from station.run.overwrite_check import refuse_originals
from station.storage.atomic import lock_output_folder, refuse_existing, write_all
from station.storage.session_folder import refuse_session
from station.words.ocr_precision import MatchCount, count_matching_characters, count_matching_words
from station.words.words import find_tesseract, findings_of_words, recognise

IN_SESSION = "what lies in a session is its record: choose a folder outside it with -o"
ENDINGS = (".txt", "-alto.xml", ".hocr", ".pdf")


@dataclass(frozen=True)
class PageRead:
    """Page, its files, number of recognised words, findings, precision with a transcript."""

    page: Path
    files: tuple[Path, ...]
    count: int
    findings: tuple[Finding, ...] = ()
    words: MatchCount | None = None
    characters: MatchCount | None = None


def read_pages(
    source: Path,
    folder: Path | None = None,
    *,
    language: str = "eng",
    truth: Path | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Iterator[PageRead]:
    """Read pages, and write the recognised text.

    source: a page or a folder of results.
    folder: for the text, that of the page when None.
    truth: a text file with the transcript of the page, for the precision.
    Raises ProgramMissing, UsageError, OverwriteError and BadInput before any page is read; StationError when Tesseract
    fails, OSError when the disk refuses.
    """
    find_tesseract()
    pages = find_pages(source)
    printed = None if truth is None else _text(truth)
    if printed is not None and len(pages) > 1:
        raise BadInput(f"{source} holds {len(pages)} pages, and the truth is about one", "give the page's own file")
    if folder is None:
        refuse_session(pages[0], IN_SESSION)
    targets = [[(folder or page.parent) / (page.stem + ending) for ending in ENDINGS] for page in pages]
    files = [path for paths in targets for path in paths]
    refuse_originals(files, [*pages, *([] if truth is None else [truth])])
    refuse_existing(files, force=force)
    for i, (page, paths) in enumerate(zip(pages, targets, strict=True)):
        progress("ocr", i / len(pages))
        yield _read(page, paths, printed, language=language, force=force)
    progress("ocr", 1.0)


def _read(page: Path, paths: list[Path], printed: str | None, *, language: str, force: bool) -> PageRead:
    stored = read_page(page)
    with lock_output_folder(paths[0].parent) as lock:
        words = recognise(stored.image, stored.dpi, name=page.name, language=language)
        pdf = encode_pdf(stored.image, stored.dpi, words, title=page.stem, profile=stored.profile)
        files = write_all(
            zip(paths, (words.text.encode(), words.alto, words.hocr, pdf), strict=True), force=force, lock=lock
        )
    measured = (
        ()
        if printed is None
        else (count_matching_words(printed, words.text), count_matching_characters(printed, words.text))
    )
    return PageRead(page, tuple(files), len(words.text.split()), findings_of_words(words), *measured)


def as_data(read: PageRead) -> dict[str, Any]:
    """Return recognition as JSON values, `correct` and `total` only with a ground truth."""
    compared = {"words": read.words, "characters": read.characters}
    return {
        "page": str(read.page),
        "recognised_words": read.count,
        **{name: {"correct": one.correct, "total": one.total} for name, one in compared.items() if one is not None},
        "files": [str(path) for path in read.files],
    }


def summary_line(read: PageRead) -> str:
    """A summary of several lines: page, number of words, precision, files."""
    lines = [f"{'page':<10} {read.page}", f"{'read':<10} {read.count} words"]
    for name, matches in (("words", read.words), ("characters", read.characters)):
        if matches is not None:
            lines.append(f"{name:<10} {matches.precision:.1%} right: {matches.correct} of {matches.total}")
    lines += [f"{one.severity:<10} {one.text}" for one in read.findings]
    return "\n".join([*lines, *(f"{'file':<10} {path}" for path in read.files)])


def _text(path: Path) -> str:
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise BadInput(f"{path} is not text: {error}", "give a text file in UTF-8") from error
