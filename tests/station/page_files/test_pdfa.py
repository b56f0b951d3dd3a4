"""The PDF of a page keeps the rules of PDF/A-2b that it could break, and the rules notice when they are broken."""

from __future__ import annotations

import io
import shutil

import numpy as np
import pikepdf
import pytest
from pikepdf import Array, Dictionary, Name

from drivers.simulated.scene.artwork import Text
from station.images.icc import srgb_profile
from station.page_files.pdf import encode_pdf
from station.words.words import recognise
from tests.station.pdfa import violations

pytestmark = pytest.mark.skipif(not shutil.which("tesseract"), reason="needs the system package tesseract-ocr")

DPI = 300.0
MM_PER_INCH, POINTS_PER_INCH = 25.4, 72.0
SIZE_MM = 0.001


KEYS = {"/Type", "/Parent", "/MediaBox", "/Resources", "/Contents", "/StructParents"}


@pytest.fixture(scope="module")
def image():
    return Text(title_pt=20, sizes_pt=(14.0,), margin_mm=10, seed=2).print_on((110.0, 70.0)).image


@pytest.fixture(scope="module")
def words(image):
    return recognise(image, DPI, name="leaf.png")


@pytest.fixture(scope="module")
def pdf(image, words):
    return encode_pdf(image, DPI, words, title="leaf")


def test_no_clause_is_broken(pdf):
    assert violations(pdf) == []


def test_no_clause_is_broken_with_a_profile_a_strange_title_and_no_words(image):
    blank = np.full((300, 200, 3), 240, np.uint8)
    words = recognise(blank, 100.0, name="blank.png")
    made = encode_pdf(blank, 100.0, words, title="Blätter & <Übriges> №1", profile=srgb_profile())
    assert violations(made) == []


def test_the_page_in_points_is_the_page_in_millimetres(pdf, image):
    with pikepdf.open(io.BytesIO(pdf)) as file:
        box = [float(edge) for edge in file.pages[0].MediaBox]
        assert set(file.pages[0].keys()) <= KEYS
    size = np.array(box[2:]) / POINTS_PER_INCH * MM_PER_INCH
    np.testing.assert_allclose(size, np.array(image.shape[1::-1]) / DPI * MM_PER_INCH, atol=SIZE_MM)
    assert box[:2] == [0, 0]


def script(pdf):
    pdf.Root.OpenAction = Dictionary(Type=Name.Action, S=Name.JavaScript, JS="app.alert(1)")


def file_within(pdf):
    pdf.attachments["notes.txt"] = b"notes"


def no_intent(pdf):
    del pdf.Root.OutputIntents


def profile_of_other_channels(pdf):
    pdf.Root.OutputIntents[0].DestOutputProfile.N = 4


def font_left_out(pdf):
    del next(iter(pdf.pages[0].Resources.Font.values())).DescendantFonts[0].FontDescriptor.FontFile2


def font_without_unicode(pdf):
    del next(iter(pdf.pages[0].Resources.Font.values())).ToUnicode


def font_of_other_widths(pdf):
    next(iter(pdf.pages[0].Resources.Font.values())).DescendantFonts[0].DW = 600


def missing_glyphs(pdf):
    next(iter(pdf.pages[0].Resources.Font.values())).DescendantFonts[0].CIDToGIDMap.write(bytes(131072))


def standard_font(pdf):
    pdf.pages[0].Resources.Font.Other = Dictionary(Type=Name.Font, Subtype=Name.Type1, BaseFont=Name.Helvetica)


def soft_mask(pdf):
    pdf.pages[0].Resources.XObject.Page.SMask = pdf.make_stream(b"")


def interpolated(pdf):
    pdf.pages[0].Resources.XObject.Page.Interpolate = True


def open_state(pdf):
    pdf.pages[0].Contents.write(pdf.pages[0].Contents.read_bytes() + b"\nq\n")


def shading_operator(pdf):
    pdf.pages[0].Contents.write(pdf.pages[0].Contents.read_bytes() + b"\n/S sh\n")


def link(pdf):
    pdf.pages[0].Annots = Array([Dictionary(Type=Name.Annot, Subtype=Name.Link, Rect=Array([0, 0, 9, 9]))])


def information(pdf):
    pdf.docinfo.Title = "another"


def other_part(pdf):
    with pdf.open_metadata(set_pikepdf_as_editor=False, update_docinfo=False) as metadata:
        metadata["pdfaid:part"] = "1"


def own_property(pdf):
    with pdf.open_metadata(set_pikepdf_as_editor=False, update_docinfo=False) as metadata:
        metadata["{http://example.org/}shelf"] = "7"


def too_large(pdf):
    pdf.pages[0].MediaBox = Array([0, 0, 20_000, 100])


@pytest.mark.parametrize(
    ("damage", "clause"),
    [
        (script, "6.3"),
        (file_within, "6.3"),
        (no_intent, "6.2.3"),
        (profile_of_other_channels, "6.2.3"),
        (font_left_out, "6.2.11.4"),
        (font_without_unicode, "6.2.11.7"),
        (font_of_other_widths, "6.2.11.5"),
        (missing_glyphs, "6.2.11.8"),
        (standard_font, "6.2.11"),
        (soft_mask, "6.2.10"),
        (interpolated, "6.2.8"),
        (open_state, "6.1.13"),
        (shading_operator, "6.2.2"),
        (link, "6.3"),
        (information, "6.6"),
        (other_part, "6.6.4"),
        (own_property, "6.6"),
        (too_large, "6.1.13"),
    ],
)
def test_a_broken_clause_is_noticed(pdf, damage, clause):
    with pikepdf.open(io.BytesIO(pdf)) as file:
        damage(file)
        out = io.BytesIO()
        file.save(out, deterministic_id=True, force_version="1.7")
    assert any(clause in one for one in violations(out.getvalue()))


@pytest.mark.parametrize("options", [{"encryption": pikepdf.Encryption(owner="o", user="")}, {"qdf": True}])
def test_how_a_file_is_written_is_noticed(pdf, options):
    out = io.BytesIO()
    with pikepdf.open(io.BytesIO(pdf)) as file:
        file.save(out, **options)
    encrypted = any("6.1.3" in one for one in violations(out.getvalue()))
    assert encrypted == ("encryption" in options)


def test_what_follows_the_end_is_noticed(pdf):
    assert any("6.1.3" in one for one in violations(pdf + b"more"))
    assert any("6.1.2" in one for one in violations(pdf.replace(b"%\xbf\xf7\xa2\xfe", b"%none")))
