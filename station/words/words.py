"""Text recognition by Tesseract: text, ALTO, hOCR, and an invisible text layer for a PDF."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import cv2
import numpy as np

from restore import Finding
from restore.scan import Bytes, Floats
from station.errors import StationError, UsageError
from station.images.png import encode_png
from station.words.columns import Gutter, find_gutters, with_rules
from station.words.greek import reading_language, respelt
from station.words.text_layer import XHTML, Paragraph, paragraphs_of

THREADS = "1"  # more wait for each other in busy loops: twice the processor time, and no faster
PACKAGE = "tesseract-ocr"  # of Debian and Ubuntu; Homebrew and Windows installers call it tesseract
# Tesseract was trained on print at about 300 dpi ("Improving the quality of the output", its manual); coarser pages
# read worse as they are. Finer ones show blur and noise of the camera as detail, and read worse as well, but small type
# needs their pixels.
READING_DPI = 300
MAX_ENLARGED = 4.0  # a page of 75 dpi: beyond that there is nothing left to read
READING_X_HEIGHT_PX = 10.0  # that of type of 5 points at READING_DPI
LETTER_INCHES = (0.012, 0.25)  # heights of the x in type of 2 points, and of capitals of 25
# A camera's blur takes contrast from fine strokes and gaps first, and Tesseract then joins letters. On pages that it
# reads as they are, sharpening only draws tails on full stops.
SHARPENED_PX, SHARPENING = 2.0, 1.0  # standard deviation of what is subtracted, at the size read, and its weight
CONFIDENT = 93.0  # mean of Tesseract's confidence in words: of sharp print 95 and more, of blurred print less than 90
DOUBTFUL = 60.0  # mean confidence below which words are not to be relied on: print upside down is read with 25 to 45
SLENDER = 3.0  # times higher than wide, or wider than high: less is a letter, more a rule
MIN_LETTERS = 30  # to determine the type
ALTO = "http://www.loc.gov/standards/alto/ns-v4#"
SCHEMA = "http://www.loc.gov/standards/alto/v4/alto-4-4.xsd"
SCHEMA_PLACE = "{http://www.w3.org/2001/XMLSchema-instance}schemaLocation"
WRITTEN_AS = "http://www.loc.gov/standards/alto/ns-v3#"  # by Tesseract; what it writes of version 3 is valid in 4
PLACES = ("HPOS", "VPOS", "WIDTH", "HEIGHT")

FORMATS = {"txt": ".txt", "alto": ".xml", "hocr": ".hocr", "pdf": ".pdf"}
# BCP 47 takes the shortest code of ISO 639; Tesseract's are those of three letters.
TAGS = {
    "Greek": "el",
    "ces": "cs",
    "dan": "da",
    "deu": "de",
    "ell": "el",
    "eng": "en",
    "fra": "fr",
    "hun": "hu",
    "ita": "it",
    "lat": "la",
    "nld": "nl",
    "pol": "pl",
    "por": "pt",
    "rus": "ru",
    "spa": "es",
    "swe": "sv",
    "ukr": "uk",
}

Which = Callable[[str], str | None]


class ProgramMissing(UsageError):
    """Raised before any work when words are asked for and Tesseract is not installed."""


@dataclass(frozen=True)
class Words:
    """Recognised text of a page.

    text   UTF-8, one line for each printed line, an empty line between paragraphs.
    alto   ALTO 4.4 (Library of Congress), positions in pixels of the page.
    hocr   hOCR 1.2, likewise.
    paragraphs  with their lines and words, in pixels of the page.
    layer  PDF of one page that holds the font of invisible glyphs.
    language  of the words, as BCP 47 has it.
    confidence  mean of Tesseract's in the words, 0 to 100; 0 without words.
    """

    text: str
    alto: bytes
    hocr: bytes
    paragraphs: tuple[Paragraph, ...]
    layer: bytes
    language: str
    confidence: float


def find_tesseract(which: Which = shutil.which) -> Path:
    """Path of the Tesseract program. Raises ProgramMissing."""
    program = which("tesseract")
    if program is None:
        raise ProgramMissing(
            "Tesseract, which reads the words, is not installed",
            f"install the system package {PACKAGE}; all but reading words works without it",
        )
    return Path(program)


def recognise(image: Bytes, dpi: float, *, name: str, language: str = "eng", which: Which = shutil.which) -> Words:
    """Read a page (h, w, 3) uint8 RGB, one inch of paper being `dpi` pixels.

    name: of the page's file, as ALTO refers to it. language: Tesseract's, several joined by +.
    Raises ProgramMissing, UsageError for a language that is not installed, StationError when Tesseract fails.
    """
    tesseract = find_tesseract(which)
    known = check_language(tesseract, language)
    sized, scale = sized_for_reading(image, dpi)
    data = reading_language(language, known)
    written, layer = _read(tesseract, sized, dpi * scale, data)
    if mean_confidence(written[-1]) < CONFIDENT:
        again = _read(tesseract, sharpened(sized), dpi * scale, data)
        written, layer = max((written, layer), again, key=lambda read: mean_confidence(read[0][-1]))
    plain = written[0].decode("utf-8")
    text, alto, hocr = (respelt(data, plain, language) for data in written)
    return Words(
        text.decode("utf-8").strip("\f\n") + "\n",
        _alto(alto, scale, name),
        _hocr(hocr, scale, name, dpi),
        paragraphs_of(hocr, scale),
        layer,
        TAGS.get(language.split("+")[0], language.split("+")[0]),
        mean_confidence(hocr),
    )


def findings_of_words(words: Words) -> tuple[Finding, ...]:
    """Return the findings about words that are not reliable.

    A page without words has none.
    """
    if not words.text.strip() or words.confidence >= DOUBTFUL:
        return ()
    return (Finding.of("words_doubtful", confidence=words.confidence, least=DOUBTFUL),)


def check_language(tesseract: Path, language: str) -> list[str]:
    """Return the languages that Tesseract has data for.

    Raises UsageError when a requested one is not among them.
    """
    known = run_tesseract(tesseract, "--list-langs").splitlines()[1:]
    for one in language.split("+"):
        if one not in known:
            raise UsageError(
                f"Tesseract has no data for the language {one!r}",
                f"install the system package {PACKAGE}-{one}, or use one of: {', '.join(known)}",
            )
    return known


def sized_for_reading(image: Bytes, dpi: float) -> tuple[Bytes, float]:
    """Return the page at the size at which it is read, and the factor.

    A page coarser than READING_DPI is enlarged to that; a finer one is shrunk to it, but no further than to where its
    small type has the height that is read reliably.
    image: (h, w, 3) uint8.
    """
    scale = min(READING_DPI / dpi, MAX_ENLARGED)
    if scale < 1.0:
        height = x_height_px(image, dpi)
        scale = min(max(scale, READING_X_HEIGHT_PX / height), 1.0) if height else 1.0
    if scale == 1.0:
        return image, scale
    kind = cv2.INTER_CUBIC if scale > 1.0 else cv2.INTER_AREA
    sized: Bytes = cv2.resize(image, None, fx=scale, fy=scale, interpolation=kind)
    return sized, scale


def _read(tesseract: Path, image: Bytes, dpi: float, data: str) -> tuple[list[bytes], bytes]:
    """Return text, ALTO and hOCR of a page, and its PDF.

    As Tesseract writes them by some data.
    image: (h, w, 3) uint8.
    """
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "page.png"), Path(folder, "page")
        source.write_bytes(encode_png(with_rules(image, _gutters(image, dpi), dpi)))
        options = ("--dpi", str(round(dpi)), "-c", "textonly_pdf=1")
        run_tesseract(tesseract, source, target, "-l", data, *options, *FORMATS)
        *written, layer = (target.with_suffix(ending).read_bytes() for ending in FORMATS.values())
    return written, layer


def mean_confidence(hocr: bytes) -> float:
    """Return Tesseract's mean confidence in a page's words, 0 to 100, 0 without words."""
    found = [float(value) for value in re.findall(rb"x_wconf (\d+)", hocr)]
    return float(np.mean(found)) if found else 0.0


def sharpened(image: Bytes) -> Bytes:
    """Raise the contrast of the strokes of letters (unsharp mask).

    The page is (h, w, 3) uint8.
    """
    blurred = cv2.GaussianBlur(image, (0, 0), SHARPENED_PX)
    return np.asarray(cv2.addWeighted(image, 1.0 + SHARPENING, blurred, -SHARPENING, 0.0))


def x_height_px(image: Bytes, dpi: float) -> float | None:
    """Return the height of small letters, pixels, in a page's smaller type, or None.

    Most letters have the height of an x; the lower quartile of the heights of what may be letters is that of the type
    that most small words are set in.
    image: (h, w, 3) uint8.
    """
    heights = letters_of(image, dpi).heights
    return float(np.quantile(heights, 0.25)) if len(heights) >= MIN_LETTERS else None


class Letters(NamedTuple):
    """Candidates of the letters of a page.

    heights: (k,) pixels.
    centres: (k, 2), x and y, in pixels.
    """

    heights: Floats
    centres: Floats


def letters_of(image: Bytes, dpi: float) -> Letters:
    """Return the patches of ink with the size and shape of letters.

    image: (h, w, 3) uint8.
    """
    _, _, stats, centres = cv2.connectedComponentsWithStats(_ink(image), connectivity=8)
    width, height = stats[1:, cv2.CC_STAT_WIDTH], stats[1:, cv2.CC_STAT_HEIGHT]
    least, most = (inches * dpi for inches in LETTER_INCHES)
    letters = (height >= least) & (height <= most) & (width >= height / SLENDER) & (width <= height * SLENDER)
    return Letters(height[letters].astype(np.float64), centres[1:][letters])


def _ink(image: Bytes) -> Bytes:
    """Return 1 where a page (h, w, 3) uint8 is dark by Otsu's threshold, else 0, (h, w)."""
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    return np.asarray(cv2.threshold(grey, 0, 1, cv2.THRESH_BINARY_INV + cv2.THRESH_OTSU)[1])


def _gutters(image: Bytes, dpi: float) -> list[Gutter]:
    """Return the gutters between a page's (h, w, 3) uint8 columns, empty without type size."""
    height = x_height_px(image, dpi)
    return find_gutters(_ink(image), height) if height else []


def run_tesseract(tesseract: Path, *arguments: Any) -> str:
    """Run Tesseract with the arguments and return what it prints.

    Raises StationError when it fails.
    """
    command, one_thread = [tesseract, *arguments], {**os.environ, "OMP_THREAD_LIMIT": THREADS}
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=True, env=one_thread)
    except subprocess.CalledProcessError as error:
        complaint = (error.stderr.strip().splitlines() or ["no reason given"])[-1]
        raise StationError(f"Tesseract failed: {complaint}", f"try the package {PACKAGE} on another image") from error
    return done.stdout


def _alto(data: bytes, scale: float, name: str) -> bytes:
    """The ALTO file in pixels of the page itself, and under its name."""
    ElementTree.register_namespace("", ALTO)
    root = ElementTree.fromstring(data.replace(WRITTEN_AS.encode(), ALTO.encode()))
    root.set(SCHEMA_PLACE, f"{ALTO} {SCHEMA}")
    for element in root.iter():
        for place in PLACES:
            if place in element.attrib:
                element.set(place, str(round(float(element.attrib[place]) / scale)))
        if element.tag == f"{{{ALTO}}}fileName":
            element.text = name
    encoded: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return encoded


def _hocr(data: bytes, scale: float, name: str, dpi: float) -> bytes:
    """The hOCR file in pixels of the page itself, and under its name."""
    ElementTree.register_namespace("", XHTML.strip("{}"))
    root = ElementTree.fromstring(data)

    def placed(match: re.Match[str]) -> str:
        return " ".join([match[1], *(str(round(float(edge) / scale)) for edge in match[2].split())])

    for element in root.iter():
        title = element.get("title")
        if title is None:
            continue
        title = re.sub(r"\b(bbox|x_size|x_descenders|x_ascenders)((?: [\d.]+)+)", placed, title)
        title = re.sub(
            r"\bbaseline (-?[\d.]+) (-?[\d.]+)", lambda m: f"baseline {m[1]} {float(m[2]) / scale:.1f}", title
        )
        if element.get("class") == "ocr_page":
            title = re.sub(r'image "[^"]*"', lambda _: f'image "{name}"', title)
            title = re.sub(r"scan_res \d+ \d+", f"scan_res {round(dpi)} {round(dpi)}", title)
        element.set("title", title)
    encoded: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return encoded
