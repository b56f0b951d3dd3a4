"""The contact sheet: every leaf once, as many sheets as are needed."""

from __future__ import annotations

import numpy as np
import pikepdf
import pytest

from oracles.tiny_scan import tiny_scan
from station.archive.contact_sheet import contact_sheet
from station.cli import main
from station.images.png import encode_png
from station.session import Volume, add_scan, create_session, open_session, read_session
from station.session.fixity.verify import verify
from station.session.log.steps import record_run
from station.session.terms.parts import RESTORE


@pytest.fixture
def book(tmp_path):
    """A session of an opening with red and blue leaves, and of a page that is not restored."""
    create_session(tmp_path / "book", Volume(title="A book"))
    with open_session(tmp_path / "book") as writer:
        capture = add_scan(writer, tiny_scan(1), facts={})
        folder = writer.staging("run")
        folder.mkdir()
        for part, colour in (("left", (255, 0, 0)), ("right", (0, 0, 255))):
            image = np.full((80, 60, 3), colour, np.uint8)
            (folder / f"page-{part}.png").write_bytes(encode_png(image, 100.0))
        result = {"parts": {"left": {}, "right": {}}}
        record_run(writer, RESTORE, capture, parameters={}, result=result, files=folder)
        add_scan(writer, tiny_scan(2), facts={})
    return tmp_path / "book"


def test_every_leaf_is_drawn(book, tmp_path):
    pdf = tmp_path / "sheet.pdf"
    pdf.write_bytes(contact_sheet(read_session(book), 3))
    with pikepdf.open(pdf) as opened:
        (page,) = opened.pages
        (stored,) = page.get_images().values()
        image = np.asarray(pikepdf.PdfImage(stored).as_pil_image().convert("RGB")).astype(int)
    red = (image[..., 0] > 200) & (image[..., 1] < 60)
    blue = (image[..., 2] > 200) & (image[..., 1] < 60)
    assert np.argwhere(red)[:, 1].max() < np.argwhere(blue)[:, 1].min()
    assert min(red.sum(), blue.sum()) == pytest.approx(60 * 80, rel=0.1)  # not enlarged; JPEG blurs its border


def test_more_leaves_need_more_sheets(book, tmp_path):
    (tmp_path / "one.pdf").write_bytes(contact_sheet(read_session(book), 1))
    with pikepdf.open(tmp_path / "one.pdf") as opened:
        assert len(opened.pages) == 3


def test_the_command_writes_a_file_and_leaves_the_session_alone(book, tmp_path):
    words = ["sheet", str(book), "-o", str(tmp_path / "sheet.pdf")]
    assert main(words) == 0
    assert main(words) == 2
    assert main(["sheet", str(book), "-o", str(book / "sheet.pdf")]) == 2
    assert verify(book).problems == ()


def test_an_empty_session_has_none(tmp_path):
    create_session(tmp_path / "empty", Volume(title="A book"))
    assert main(["sheet", str(tmp_path / "empty"), "-o", str(tmp_path / "a.pdf")]) == 3
