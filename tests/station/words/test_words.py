"""Words of a page whose print is known: text, ALTO, PDF/A, and the command that writes them."""

from __future__ import annotations

import io
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import cv2
import numpy as np
import pikepdf
import pytest
import tifffile
from PIL import Image

from drivers.simulated.scene.artwork import Text
from restore.errors import BadInput
from station.cli import main
from station.errors import StationError, UsageError
from station.images.pages import find_pages, read_page
from station.images.png import encode_png
from station.images.tiff import encode_tiff
from station.page_files.pdf import encode_pdf
from station.run.ocr import ENDINGS
from station.words import words as words_module
from station.words.ocr_precision import count_matching_characters, count_matching_words
from station.words.words import (
    ALTO,
    READING_DPI,
    ProgramMissing,
    check_language,
    find_tesseract,
    findings_of_words,
    mean_confidence,
    recognise,
    sharpened,
    sized_for_reading,
    x_height_px,
)
from tests.station.archive.schema import schema, violations

needs_tesseract = pytest.mark.skipif(not shutil.which("tesseract"), reason="needs the system package tesseract-ocr")

PAGE_MM, DPI = (110.0, 70.0), 150
MM_PER_INCH, POINTS_PER_MM = 25.4, 72 / 25.4
PLACE_MM = 1.0  # Tesseract's boxes keep off the ink by a pixel or two, and ascenders are not always in them
HALF_PIXEL_PER_METRE = 0.5 * 0.0254 + 1e-9  # PNG counts whole pixels a metre
SIZE_POINTS = 0.01  # the file keeps four digits


RIGHT = re.compile(r"([\d.]+) Tz 1 0 0 1 ([\d.]+) [\d.]+ Tm <([0-9A-F]+)>")


def size_of(content):
    """Size of the first type in a content stream, in its own units."""
    return float(re.search(r"/\S+ ([\d.]+) Tf", content)[1])


@pytest.fixture(scope="module")
def printed():
    return Text(title_pt=20, sizes_pt=(14.0, 12.0), margin_mm=10, seed=2).print_on(PAGE_MM)


@pytest.fixture(scope="module")
def image(printed):
    size = tuple(round(side / MM_PER_INCH * DPI) for side in PAGE_MM)
    return np.asarray(Image.fromarray(printed.image).resize(size, Image.Resampling.BOX))


@pytest.fixture(scope="module")
def truth(printed):
    return " ".join(word.text for word in printed.words)


@pytest.fixture(scope="module")
def words(image):
    return recognise(image, DPI, name="leaf.png")


@pytest.fixture(scope="module")
def pdf(image, words):
    return encode_pdf(image, DPI, words, title="leaf")


@pytest.fixture
def result(tmp_path, image):
    """A folder of results with one page."""
    (tmp_path / "leaf.png").write_bytes(encode_png(image, DPI))
    (tmp_path / "leaf.json").write_text(json.dumps({"files": ["leaf.png", "leaf.json"]}))
    (tmp_path / "leaf-review.png").write_bytes(encode_png(image))
    return tmp_path


@needs_tesseract
def test_a_clean_page_is_read_whole(words, truth):
    assert count_matching_words(truth, words.text).precision == 1.0
    assert count_matching_characters(truth, words.text).precision == 1.0


@needs_tesseract
def test_alto_shows_where_every_word_stands_on_the_page(words, printed, image):
    root = ElementTree.fromstring(words.alto)
    strings = root.findall(f".//{{{ALTO}}}String")
    assert [string.get("CONTENT") for string in strings] == [word.text for word in printed.words]
    for string, word in zip(strings, printed.words, strict=True):
        left, top = (float(string.attrib[key]) / DPI * MM_PER_INCH for key in ("HPOS", "VPOS"))
        assert left == pytest.approx(word.box[0], abs=PLACE_MM)
        assert PAGE_MM[1] - top == pytest.approx(word.box[3], abs=PLACE_MM)
    page = root.find(f".//{{{ALTO}}}Page")
    assert (int(page.attrib["WIDTH"]), int(page.attrib["HEIGHT"])) == image.shape[1::-1]
    assert root.findtext(f".//{{{ALTO}}}fileName") == "leaf.png"


@needs_tesseract
def test_alto_keeps_to_its_schema(words):
    alto = schema("alto-4-4.xsd")
    assert violations(alto, words.alto) == []
    assert violations(alto, words.alto.replace(b"HPOS", b"XPOS"))


@needs_tesseract
def test_hocr_shows_the_same_words_in_pixels_of_the_page(words, printed, image):
    root = ElementTree.fromstring(words.hocr)
    page, *_ = (element for element in root.iter() if element.get("class") == "ocr_page")
    assert f'image "leaf.png"; bbox 0 0 {image.shape[1]} {image.shape[0]}' in page.get("title")
    found = [element for element in root.iter() if element.get("class") == "ocrx_word"]
    assert ["".join(element.itertext()) for element in found] == [word.text for word in printed.words]
    for element, word in zip(found, printed.words, strict=True):
        left, *_ = (float(edge) for edge in element.get("title").split(";")[0].split()[1:])
        assert left / DPI * MM_PER_INCH == pytest.approx(word.box[0], abs=PLACE_MM)


@needs_tesseract
def test_every_paragraph_of_the_pdf_is_tagged_and_its_language_named(pdf, words):
    with pikepdf.open(io.BytesIO(pdf)) as file:
        assert str(file.Root.Lang) == words.language == "en"
        assert bool(file.Root.MarkInfo.Marked)
        elements = list(file.Root.StructTreeRoot.K.K)
        assert [int(element.K) for element in elements] == list(range(len(words.paragraphs)))
        assert all(element.S == "/P" and element.Pg.objgen == file.pages[0].obj.objgen for element in elements)
        content = file.pages[0].Contents.read_bytes().decode()
        assert content.count("BDC") == len(elements) > 1
        assert content.count("BDC") + content.count("BMC") == content.count("EMC")


@needs_tesseract
def test_the_pdf_has_the_size_of_the_paper_and_its_picture_without_loss(pdf, image):
    with pikepdf.open(io.BytesIO(pdf)) as file:
        (page,) = file.pages
        size = [float(edge) for edge in page.MediaBox]
        assert size == pytest.approx([0, 0, *(n / DPI * 72 for n in image.shape[1::-1])], abs=SIZE_POINTS)
        np.testing.assert_array_equal(np.asarray(pikepdf.PdfImage(page.Resources.XObject.Page).as_pil_image()), image)


@needs_tesseract
def test_the_pdf_keeps_its_true_size_at_any_resolution(image, words):
    with pikepdf.open(io.BytesIO(encode_pdf(image, 149.37, words, title="leaf"))) as file:
        assert float(file.pages[0].MediaBox[2]) == pytest.approx(image.shape[1] / 149.37 * 72, abs=SIZE_POINTS)


@needs_tesseract
def test_words_of_the_pdf_are_invisible_and_stand_on_those_of_the_picture(pdf, printed):
    with pikepdf.open(io.BytesIO(pdf)) as file:
        content = file.pages[0].Contents.read_bytes().decode()
    text = "".join(bytes.fromhex(run).decode("utf-16-be") for run in re.findall(r"<([0-9A-F]+)>", content))
    assert text.split() == [word.text for word in printed.words]
    assert "3 Tr" in content  # neither filled nor stroked (ISO 32000-1, table 106)
    scale = float(re.search(r"q ([\d.]+) 0 0 [\d.]+ 0 0 cm\n", content.partition("Q\n")[2]).group(1))
    left, base = (scale * float(n) for n in re.search(r"1 0 0 1 ([\d.]+) ([\d.]+) Tm", content).groups())
    first = printed.words[0].box
    right = RIGHT.search(content)
    start, end = float(right[2]), float(right[2]) + float(right[1]) / 100 * size_of(content) / 2 * (len(right[3]) / 4)
    assert scale * start / POINTS_PER_MM == pytest.approx(first[0], abs=PLACE_MM)
    assert scale * end / POINTS_PER_MM == pytest.approx(first[2], abs=PLACE_MM)
    assert "  " not in text
    assert left / POINTS_PER_MM == pytest.approx(first[0], abs=PLACE_MM)
    assert base / POINTS_PER_MM == pytest.approx(first[1], abs=PLACE_MM)


@needs_tesseract
def test_the_pdf_declares_itself_pdf_a_and_keeps_the_rules_that_can_be_seen(pdf):
    with pikepdf.open(io.BytesIO(pdf)) as file:
        assert file.open_metadata().pdfa_status == "2B"
        (intent,) = file.Root.OutputIntents
        assert intent.S == "/GTS_PDFA1"
        assert intent.DestOutputProfile.read_bytes()[36:40] == b"acsp"
        assert "/Info" not in file.trailer  # else it would have to agree with the XMP
        assert len(file.trailer.ID) == 2
        assert not file.is_encrypted
        assert "/Filter" not in file.Root.Metadata
        fonts = list(file.pages[0].Resources.Font.values())
        assert fonts
        for font in fonts:
            (descendant,) = font.DescendantFonts
            assert "/FontFile2" in descendant.FontDescriptor
            assert "/ToUnicode" in font


@needs_tesseract
def test_a_blank_page_has_no_words():
    blank = np.full((400, 300, 3), 240, np.uint8)
    found = recognise(blank, 100, name="blank.png")
    assert found.text.split() == []
    assert encode_pdf(blank, 100, found, title="blank").startswith(b"%PDF-1.7")


def test_a_missing_tesseract_is_named_with_its_package():
    with pytest.raises(ProgramMissing, match="Tesseract") as caught:
        find_tesseract(lambda _: None)
    assert "tesseract-ocr" in caught.value.hint
    assert caught.value.exit_code == 2


@needs_tesseract
def test_a_language_that_is_not_there_is_named_with_its_package():
    with pytest.raises(UsageError, match="'tlh'") as caught:
        check_language(find_tesseract(), "eng+tlh")
    assert "tesseract-ocr-tlh" in caught.value.hint


def test_a_tesseract_that_fails_is_reported(tmp_path, image):
    program = tmp_path / "tesseract"
    program.write_text('#!/bin/sh\n[ "$1" = --list-langs ] && printf "Languages:\\neng\\n" && exit\n'
                       "echo first >&2; echo no memory >&2; exit 1\n")  # fmt: skip
    program.chmod(0o755)
    with pytest.raises(StationError, match="no memory"):
        recognise(image, DPI, name="leaf.png", which=lambda _: str(program))


@needs_tesseract
def test_ocr_reads_a_folder_of_results(result, truth, capsys):
    (result / "print.text").write_text(truth)
    assert main(["ocr", str(result), "-o", str(result / "read"), "--ground-truth", str(result / "print.text")]) == 0
    assert {path.name for path in (result / "read").iterdir()} == {"leaf" + ending for ending in ENDINGS}
    out = capsys.readouterr().out
    assert "words      100.0% right" in out
    assert "characters 100.0% right" in out


@needs_tesseract
def test_ocr_writes_next_to_the_page_and_overwrites_nothing(result, capsys):
    assert main(["ocr", str(result / "leaf.png")]) == 0
    before = (result / "leaf.pdf").read_bytes()
    assert main(["ocr", str(result / "leaf.png")]) == 2
    assert "--force" in capsys.readouterr().err
    assert main(["ocr", str(result / "leaf.png"), "--force"]) == 0
    assert (result / "leaf.pdf").read_bytes() == before  # the same page gives the same file


@needs_tesseract
@pytest.mark.parametrize("link", [None, Path.hardlink_to, Path.symlink_to])
def test_ocr_never_overwrites_the_transcript(result, truth, capsys, link):
    transcript = result / ("leaf.txt" if link is None else "transcript.txt")
    transcript.write_text(truth)
    if link is not None:
        link(result / "leaf.txt", transcript)
    assert main(["ocr", str(result / "leaf.png"), "--ground-truth", str(transcript), "--force"]) == 2
    assert f"{result / 'leaf.txt'} is the original, which is never overwritten" in capsys.readouterr().err
    assert transcript.read_text() == truth
    assert not (result / "leaf.pdf").exists()


@needs_tesseract
def test_restore_reads_the_words_too(library, scan_file, tmp_path):
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out"), "--ocr"]) == 0
    report = json.loads((tmp_path / "out" / "book.json").read_text())
    assert {"book" + ending for ending in ENDINGS} <= set(report["files"])
    assert report["seconds"]["ocr"] > 0


@pytest.mark.parametrize("command", ["restore", "scan", "ocr"])
def test_without_tesseract_nothing_is_begun(
    library, scanner, scan_file, config_file, result, tmp_path, capsys, monkeypatch, command
):
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    asked = {
        "restore": [str(scan_file), "--ocr"],
        "scan": ["--config", str(config_file), "--ocr"],
        "ocr": [str(result)],
    }[command]
    assert main([command, *asked, "-o", str(tmp_path / "out")]) == 2
    assert "tesseract-ocr" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert (library.calls, scanner.closed) == ([], 0)


def test_pages_are_known_by_their_reports(result):
    assert find_pages(result) == [result / "leaf.png"]
    assert find_pages(result / "leaf-review.png") == [result / "leaf-review.png"]


def test_a_folder_without_pages_is_refused(tmp_path):
    with pytest.raises(BadInput, match="no restored page"):
        find_pages(tmp_path)
    with pytest.raises(BadInput, match="is not a page"):
        find_pages(tmp_path / "scan.obj")


@pytest.mark.parametrize("dpi", [72, 150, 400.5])
def test_a_page_shows_its_resolution(tmp_path, image, dpi):
    (tmp_path / "page.png").write_bytes(encode_png(image, dpi))
    (tmp_path / "page.tif").write_bytes(encode_tiff(image, dpi))
    for name in ("page.png", "page.tif"):
        page = read_page(tmp_path / name)
        assert page.dpi == pytest.approx(dpi, abs=HALF_PIXEL_PER_METRE)
        np.testing.assert_array_equal(page.image, image)


def test_a_page_without_a_resolution_is_refused(tmp_path, image):
    (tmp_path / "page.png").write_bytes(encode_png(image))
    tifffile.imwrite(tmp_path / "page.tif", image, photometric="rgb")
    for name in ("page.png", "page.tif"):
        with pytest.raises(BadInput, match="how large"):
            read_page(tmp_path / name)


@pytest.mark.parametrize("damage", [lambda data: data[:1000], lambda data: b"", lambda data: b"words"])
def test_a_damaged_page_is_bad_input(result, damage, capsys):
    page: Path = result / "leaf.png"
    page.write_bytes(damage(page.read_bytes()))
    expected = 3 if shutil.which("tesseract") else 2
    assert main(["ocr", str(page)]) == expected
    assert "leaf.png" in capsys.readouterr().err or expected == 2


def test_what_is_read_is_written_by_one_table():
    from station.page_files.outputs import OUTPUTS

    assert tuple(output.suffix for output in OUTPUTS if output.kind == "ocr") == ENDINGS
    assert words_module.PACKAGE == "tesseract-ocr"


SMALL_MM, SMALL_PT, FINE_DPI = (80.0, 25.0), 5.0, 600
CAMERA_DPI, CAMERA_BLUR_PX = 150, 1.0  # what a page painted at FINE_DPI really shows
READ_SIZED = 0.92  # of the words; at its own size the page reads several points worse
X_HEIGHT = 0.47  # of the size of the type, of the serif face


def small_print(seed=61):
    """Type of five points from a blurred camera, enlarged to FINE_DPI; and its words."""
    page = Text(title_pt=10, sizes_pt=(SMALL_PT,), margin_mm=4, seed=seed, dpi=FINE_DPI).print_on(SMALL_MM)
    size, fine = (tuple(round(side / MM_PER_INCH * dpi) for side in SMALL_MM) for dpi in (CAMERA_DPI, FINE_DPI))
    seen = np.asarray(Image.fromarray(page.image).resize(size, Image.Resampling.BOX))
    seen = cv2.GaussianBlur(seen, (0, 0), CAMERA_BLUR_PX) + np.random.default_rng(seed).normal(0, 3, seen.shape)
    picture = Image.fromarray(np.clip(seen, 0, 255).astype(np.uint8)).resize(fine, Image.Resampling.BICUBIC)
    return np.asarray(picture), " ".join(word.text for word in page.words)


@needs_tesseract
def test_small_print_of_a_fine_page_is_read_at_the_size_of_its_type():
    picture, text = small_print()
    read = recognise(picture, FINE_DPI, name="small").text
    assert count_matching_words(text, read).precision >= READ_SIZED


@needs_tesseract
def test_sharpening_lets_more_of_blurred_small_print_be_read(monkeypatch):
    picture, text = small_print()
    sharp = count_matching_words(text, recognise(picture, FINE_DPI, name="small").text)
    monkeypatch.setattr(words_module, "sharpened", lambda image: image)
    plain = count_matching_words(text, recognise(picture, FINE_DPI, name="small").text)
    assert sharp.correct > plain.correct


@needs_tesseract
def test_print_that_is_read_surely_is_not_sharpened(monkeypatch):
    monkeypatch.delattr(words_module, "sharpened")
    page = Text(title_pt=20, sizes_pt=(12.0,), margin_mm=8, dpi=FINE_DPI).print_on(SMALL_MM)
    text = " ".join(word.text for word in page.words)
    assert count_matching_words(text, recognise(page.image, FINE_DPI, name="page").text).precision > READ_SIZED


def test_the_confidence_in_a_page_is_the_mean_of_its_words():
    words = b"<span title='bbox 0 0 9 9; x_wconf 96'>a</span><span title='bbox 9 0 19 9; x_wconf 80'>b</span>"
    assert mean_confidence(words) == pytest.approx(88.0)
    assert mean_confidence(b"<div class='ocr_page'></div>") == 0.0


@pytest.mark.parametrize(
    ("text", "confidence", "codes"),
    [("page", 96.0, []), ("page", 38.0, ["words_doubtful"]), ("\n", 0.0, [])],  # upright, upside down, blank
)
def test_words_of_little_confidence_are_reported(words, text, confidence, codes):
    found = findings_of_words(replace(words, text=text, confidence=confidence))
    assert [one.code for one in found] == codes


@needs_tesseract
def test_a_page_upside_down_is_reported_with_its_words(tmp_path, image, capsys):
    (tmp_path / "page.png").write_bytes(encode_png(np.ascontiguousarray(image[::-1, ::-1]), DPI))
    assert main(["ocr", str(tmp_path / "page.png")]) == 0
    assert "less than 60" in capsys.readouterr().out


def test_sharpening_leaves_even_paper_and_raises_the_contrast_of_strokes():
    page = np.full((60, 60, 3), 200, np.uint8)
    np.testing.assert_array_equal(sharpened(page), page)
    page[:, 28:31] = 120
    assert sharpened(page)[30, 29, 0] < 105


@pytest.mark.parametrize("dpi", [300, 600])
@pytest.mark.parametrize("size_pt", [5.0, 12.0])
def test_the_height_of_small_letters_is_that_of_the_type(dpi, size_pt):
    page = Text(title_pt=24, sizes_pt=(size_pt,), margin_mm=4, seed=3, dpi=dpi).print_on((90.0, 60.0))
    assert x_height_px(page.image, dpi) == pytest.approx(X_HEIGHT * size_pt / 72 * dpi, rel=0.15, abs=1.5)


def test_a_page_is_enlarged_to_300_dpi_and_shrunk_no_further_than_its_type_allows():
    fine = Text(title_pt=24, sizes_pt=(12.0,), margin_mm=4, seed=3, dpi=600).print_on((90.0, 60.0)).image
    small = Text(title_pt=8, sizes_pt=(4.0,), margin_mm=4, seed=3, dpi=600).print_on((50.0, 30.0)).image
    assert sized_for_reading(fine, 600)[1] == READING_DPI / 600
    assert READING_DPI / 600 < sized_for_reading(small, 600)[1] <= 1.0
    assert sized_for_reading(fine, 150)[1] == READING_DPI / 150
    assert sized_for_reading(fine, 300)[1] == 1.0
    blank = np.full((80, 90, 3), 255, np.uint8)
    assert x_height_px(blank, 600) is None
    assert sized_for_reading(blank, 600)[1] == 1.0
