"""Exported words say where their page is; what is damaged is refused."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime

import pytest
from lxml import etree

from restore import BadInput
from station.archive.alto import EVENT, placed_alto, with_placed_words
from station.archive.volume import Page, Role, StoredFile, Volume
from tests.station.archive.test_leaf_sides import ALTO

NOW = datetime(2026, 1, 1, tzinfo=UTC)


@pytest.mark.parametrize(
    ("kind", "side", "position"),
    [("", "left", "Left"), ("", "right", "Right"), ("plate", "", "Single"), ("cover", "right", "Cover")],
)
def test_the_place_of_a_page(kind, side, position):
    page = etree.fromstring(placed_alto(ALTO.encode(), Page(7, "3r", (), side, kind=kind)))[1][0]
    found = [page.get(name) for name in ("PHYSICAL_IMG_NR", "PRINTED_IMG_NR", "POSITION", "PAGECLASS")]
    assert found == ["7", "3r", position, kind or None]


def test_the_digest_is_that_of_the_exported_copy(tmp_path):
    path = tmp_path / "page-alto.xml"
    path.write_text(ALTO)
    file = StoredFile(path, "page-alto.xml", Role.WORDS, hashlib.sha512(path.read_bytes()).hexdigest(), 1, "000001")
    volume = Volume("id", "A", (Page(1, "i", (file,)),), (), NOW)
    placed = with_placed_words(volume, NOW)
    (changed,) = placed.pages[0].files
    assert (hashlib.sha512(changed.made()).hexdigest(), len(changed.made())) == (changed.sha512, changed.size)
    assert [(event.identifier, event.results) for event in placed.events] == [(EVENT, ("page-alto.xml",))]
    path.write_text(ALTO + " ")
    with pytest.raises(BadInput, match="digest"):
        with_placed_words(volume, NOW)
    with pytest.raises(BadInput, match="damaged"):
        placed_alto(b"<alto", volume.pages[0])
