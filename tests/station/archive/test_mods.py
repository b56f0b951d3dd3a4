"""The MODS of an export is read back as the description that it was made from."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import pytest

from station.archive.mets import encode_mets
from station.archive.mods import encode_mods
from station.session.terms.about import About, Identifier
from station.session.terms.about_files import read_about
from tests.station.archive.conftest import NOW
from tests.station.archive.schema import schema, violations

ABOUT = About(
    title="Das Buch & mehr",
    creators=["A", "B"],
    date="1484",
    place="Mainz",
    publisher="P. Schöffer",
    language="de",
    shelfmark="Inc. 12",
    identifiers=[Identifier(scheme="urn", value="urn:nbn:1"), Identifier(value="2")],
    rights="http://rightsstatements.org/vocab/NoC-US/1.0/",
    owner="A library",
    extent="96 leaves",
)


@pytest.mark.parametrize("about", [ABOUT, About(title="A"), About(shelfmark="1"), About(language="gsw")])
def test_a_description_comes_back(about, tmp_path):
    (tmp_path / "mods.xml").write_bytes(ElementTree.tostring(encode_mods(about), encoding="utf-8"))
    assert read_about(tmp_path / "mods.xml") == about


def test_mets_holds_it_next_to_dublin_core(volume, tmp_path):
    data = encode_mets(replace(volume, about=ABOUT), {}, now=NOW)
    wanted = ("mets-1-12-1.xsd", "premis-v2-3.xsd", "mix20.xsd")
    assert violations(schema(*wanted), data) == []
    (tmp_path / "mets.xml").write_bytes(data)
    assert read_about(tmp_path / "mets.xml") == ABOUT
    assert b"MODS" not in encode_mets(volume, {}, now=NOW)
