"""Labels are compared with the numbers at the head and foot of the pages; nothing is set."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.tiny_scan import tiny_scan
from station.images.pages import StoredPage
from station.images.png import encode_png
from station.session import Volume, add_scan, create_session, open_session
from station.session.leaves.printed import Printed, printed_numbers, printed_on
from station.session.log.steps import record_run
from station.session.terms.labels import numbers_in

WHITE = np.full((80, 60, 3), 255, np.uint8)


@pytest.mark.parametrize(
    ("head", "foot", "printed"),
    [
        ("", "— 12 —", "12"),
        ("xiv", "", "xiv"),
        ("14  A TITLE", "some text of 1484 in it", "14"),
        ("A TITLE 15", "", "15"),
        ("A TITLE", "the last line of text", ""),
        ("7", "9", ""),
        ("", "[3v]", "3"),
    ],
)
def test_a_number_stands_alone_or_at_an_end_of_the_running_title(head, foot, printed):
    texts = iter([head, foot])
    bands = []

    def read(image, dpi):
        bands.append((image.shape[0], dpi))
        return next(texts)

    assert printed_on(StoredPage("page.png", WHITE, 150.0), read) == printed
    assert bands == [(10, 150.0)] * 2


@pytest.mark.parametrize(
    ("label", "printed", "differs"),
    [
        ("12", "12", False),
        ("12r", "12", False),
        ("xiv", "14", False),
        ("12", "13", True),
        ("12", "", False),
        ("12v–13r", "13", False),
    ],
)
def test_a_number_differs_from_a_label(label, printed, differs):
    assert Printed("1", label, printed).differs is differs


def test_numbers_of_labels():
    assert [numbers_in(label) for label in ("", "[4]", "A-12", "plate")] == [set(), {4}, {12}, set()]


def test_every_restored_leaf_is_read(tmp_path):
    create_session(tmp_path / "book", Volume(title="A book"))
    with open_session(tmp_path / "book") as writer:
        for seed in range(3):
            capture = add_scan(writer, tiny_scan(seed), facts={})
            if seed < 2:
                folder = writer.staging("page")
                folder.mkdir(parents=True)
                (folder / "page.png").write_bytes(encode_png(WHITE, 150.0))
                record_run(writer, "restore", capture, parameters={}, result={}, files=folder)
        events = len(writer.history.events)
        found = list(printed_numbers(writer.session, lambda *_: "2"))
        assert [(one.name, one.label, one.differs) for one in found] == [("1", "1", True), ("2", "2", False)]
        assert len(writer.history.events) == events
