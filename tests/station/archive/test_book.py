"""The PDF of a volume: PDF/A, its pages with their labels, sizes and words."""

from __future__ import annotations

import shutil

import numpy as np
import pikepdf
import pytest

from station.archive.book import Leaf, write_book
from station.archive.volume import Role
from tests.station.archive.conftest import DPI, STRANGE, picture
from tests.station.pdfa import violations

POINTS = 72.0
PNG_SCALE = 0.5 / 11811  # relative: a PNG counts whole pixels to the metre, 11811 for 300 dpi
ROUNDED = 1e-4  # points: four digits


@pytest.fixture
def book(volume, tmp_path):
    leaves = []
    for page in volume.pages[:2]:
        words = page.find(Role.PDF)
        leaves.append(Leaf(page.label, page.find(Role.PAGE).path, None if words is None else words.path))
    write_book(leaves, tmp_path / "volume.pdf", title=STRANGE)
    return tmp_path / "volume.pdf"


def test_no_clause_is_broken(book) -> None:
    assert violations(book.read_bytes()) == []


def test_pages_have_their_labels_and_sizes(book, volume) -> None:
    with pikepdf.open(book) as pdf:
        assert [page.label for page in pdf.pages] == ["1r", "1v"]
        for page in pdf.pages:
            size = [float(edge) for edge in page.MediaBox[2:]]
            expected = np.array(picture(1).shape[1::-1]) * POINTS / DPI
            np.testing.assert_allclose(size, expected, rtol=PNG_SCALE, atol=ROUNDED)
        assert str(pdf.open_metadata()["dc:title"]) == STRANGE


@pytest.mark.skipif(not shutil.which("tesseract"), reason="needs the system package tesseract-ocr")
def test_words_of_the_page_are_those_of_the_volume(book, volume) -> None:
    with pikepdf.open(book) as pdf, pikepdf.open(volume.pages[0].find(Role.PDF).path) as single:
        assert pdf.pages[0].Contents.read_bytes() == single.pages[0].Contents.read_bytes()
        tree = pdf.Root.StructTreeRoot
        marks = list(tree.ParentTree.Nums[1])
        assert len(marks) == len(single.Root.StructTreeRoot.ParentTree.Nums[1]) > 0
        assert all(mark.Pg.objgen == pdf.pages[0].objgen for mark in marks)
        assert len(tree.ParentTree.Nums[3]) == 0  # the second page has no words
        assert [int(page.StructParents) for page in pdf.pages] == [0, 1]
        assert str(pdf.Root.Lang) == "en"


def test_a_volume_without_words_is_a_pdf_too(volume, tmp_path) -> None:
    write_book([Leaf("i", volume.pages[1].find(Role.PAGE).path)], tmp_path / "v.pdf", title="x")
    assert violations((tmp_path / "v.pdf").read_bytes()) == []
