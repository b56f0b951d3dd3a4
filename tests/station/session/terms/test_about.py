"""The description of a volume: set by hand or taken from a catalogue, one decision, one undo."""

from __future__ import annotations

import json

import pytest

from restore import BadInput
from station.cli import main
from station.session import Volume, create_session, open_session, read_session, undo
from station.session.log.current import about_of
from station.session.terms.about import About, changed_about
from station.session.terms.about_files import read_about

MODS = """<?xml version="1.0"?>
<modsCollection xmlns="http://www.loc.gov/mods/v3"><mods>
  <titleInfo type="alternative"><title>Another</title></titleInfo>
  <titleInfo><nonSort>Das</nonSort><title>Buch</title><subTitle>ein Druck</subTitle></titleInfo>
  <name><namePart type="family">Muster</namePart><namePart type="given">A.</namePart>
    <namePart type="date">1450-1510</namePart></name>
  <originInfo><place><placeTerm type="code">gw</placeTerm><placeTerm type="text">Mainz</placeTerm></place>
    <publisher>P. Schöffer</publisher><dateIssued>1484</dateIssued></originInfo>
  <language><languageTerm type="code" authority="iso639-2b">ger</languageTerm></language>
  <physicalDescription><extent>96 leaves</extent></physicalDescription>
  <location><physicalLocation>A library</physicalLocation><shelfLocator>Inc. 12</shelfLocator></location>
  <identifier type="urn">urn:nbn:1</identifier><identifier type="isbn" invalid="yes">0</identifier>
  <accessCondition xmlns:xlink="http://www.w3.org/1999/xlink"
    xlink:href="http://rightsstatements.org/vocab/NoC-US/1.0/">free</accessCondition>
</mods></modsCollection>"""
OF_MODS = {
    "title": "Das Buch: ein Druck",
    "creators": ["Muster A."],
    "date": "1484",
    "place": "Mainz",
    "publisher": "P. Schöffer",
    "language": "de",
    "shelfmark": "Inc. 12",
    "identifiers": [{"scheme": "urn", "value": "urn:nbn:1"}],
    "rights": "http://rightsstatements.org/vocab/NoC-US/1.0/",
    "owner": "A library",
    "extent": "96 leaves",
}
DC = """<oai_dc:dc xmlns:oai_dc="http://www.openarchives.org/OAI/2.0/oai_dc/" xmlns:dc="http://purl.org/dc/elements/1.1/">
  <dc:title> A
   title </dc:title><dc:creator>A</dc:creator><dc:creator>B</dc:creator><dc:language>heb</dc:language>
  <dc:rights>see https://example.org/r</dc:rights><dc:identifier>isbn 1</dc:identifier><dc:date/></oai_dc:dc>"""
ENTITY = """<!DOCTYPE mods [<!ENTITY a SYSTEM "file:///etc/hostname">]>
<mods xmlns="http://www.loc.gov/mods/v3"><titleInfo><title>&a;</title></titleInfo></mods>"""


def read(tmp_path, text, name="about.xml"):
    (tmp_path / name).write_text(text)
    return read_about(tmp_path / name)


def test_a_record_of_a_catalogue_is_read(tmp_path):
    assert read(tmp_path, MODS).given() == OF_MODS
    assert read(tmp_path, DC).given() == {
        "title": "A title",
        "creators": ["A", "B"],
        "language": "he",
        "identifiers": [{"value": "isbn 1"}],
        "rights": "https://example.org/r",
    }
    toml = 'title = "A"\ndirection = "rtl"\n[[identifiers]]\nscheme = "ppn"\nvalue = "1"\n'
    assert read(tmp_path, toml, "about.toml").given()["identifiers"] == [{"scheme": "ppn", "value": "1"}]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (ENTITY, "document type"),
        ("<mods", "is not XML"),
        ("", "is not XML"),
        ("<html/>", "neither MODS nor Dublin Core"),
        ("<a>" * 30_000, "is not XML"),
        ("x" * (2**20 + 1), "cannot read"),
        (MODS.replace("Mainz", "M" * 501), "place: "),
    ],
    ids=["entity", "cut off", "empty", "other", "deep", "large", "long"],
)
def test_a_hostile_record_is_refused(tmp_path, text, reason):
    with pytest.raises(BadInput, match=reason):
        read(tmp_path, text)


@pytest.mark.parametrize("text", [".".join(["a"] * 100_000) + " = 1", "a = " + "[" * 5000 + "]" * 5000])
def test_a_table_that_would_take_all_memory_is_refused(tmp_path, text):
    with pytest.raises(BadInput, match=r"dots|nested"):
        read(tmp_path, text, "about.toml")


def test_fields_are_set_and_taken_away():
    about = changed_about(About(title="A"), ["creators=B; C", "identifiers=ppn:1; 2", "title="])
    assert about.given() == {"creators": ["B", "C"], "identifiers": [{"scheme": "ppn", "value": "1"}, {"value": "2"}]}
    for word in ("language=deutsch land", "rights=free", "direction=up", "title=" + 501 * "x"):
        with pytest.raises(BadInput, match=word.partition("=")[0]):
            changed_about(About(), [word])


def test_a_description_is_one_decision(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PLANISH_INDEX", str(tmp_path / "sessions.sqlite"))
    book = tmp_path / "book"
    create_session(book, Volume(title="A book"))
    (tmp_path / "mods.xml").write_text(MODS)
    command = ["session", "about", str(book)]
    assert main([*command, "--from", str(tmp_path / "mods.xml"), "--set", "direction=rtl", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {**OF_MODS, "direction": "rtl"}
    assert len(read_session(book).history.events) == 2
    assert main([*command, "--clear", "--dry-run"]) == 0
    assert main(command) == 0
    assert "identifiers  urn:urn:nbn:1" in capsys.readouterr().out
    assert len(read_session(book).history.events) == 2
    assert [main([*command, *words]) for words in (["--set", "colour=1"], ["--clear", "--set", "title=A"])] == [2, 2]
    assert [main([*command, *words]) for words in (["--set", "rights=x"], ["--from", "gone.xml"])] == [3, 3]
    with open_session(book) as writer:
        undo(writer)
        assert about_of(writer.history) == About()
