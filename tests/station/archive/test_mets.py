"""The METS document keeps the official schemas, with all that is wrapped in it, and says what the record says."""

from __future__ import annotations

import dataclasses
import errno
import json
import shutil
from xml.etree import ElementTree

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from restore import BadInput
from station.archive import mix
from station.archive.mets import encode_mets
from station.archive.mix import read_image_facts
from station.archive.premis import encode_agents, encode_event, encode_object
from station.archive.volume import Role, Volume
from station.archive.xml import METS, MIX, PREMIS, XLINK, clean, encode
from tests.station.archive.conftest import DPI, NOW, STRANGE
from tests.station.archive.schema import parts, schema, violations

HALF_PIXEL_PER_METRE = 0.5 * 0.0254  # a PNG counts whole pixels to the metre


@pytest.fixture(scope="module")
def document(volume) -> bytes:
    images = {f.name: read_image_facts(f.path) for f in volume.files if f.media_type.startswith("image/")}
    return encode_mets(volume, images, now=NOW)


def test_the_document_is_valid_with_all_that_it_wraps(document) -> None:
    compiled = schema("mets-1-12-1.xsd", "premis-v2-3.xsd", "mix20.xsd")
    assert violations(compiled, document) == []
    nested = document.replace(b">SHA-512</mix:", b">SHA-five</mix:").replace(b"premis:eventDateTime", b"premis:when")
    kinds = {wrong.partition("{")[2].partition("}")[0] for wrong in violations(compiled, nested)}
    assert kinds == {PREMIS.strip("{}"), MIX.strip("{}")}


@pytest.mark.parametrize("kind", ["object", "event", "agent"])
def test_every_premis_element_is_valid(document, kind) -> None:
    compiled = schema("premis-v2-3.xsd")
    found = parts(document, f"{PREMIS}{kind}")
    assert found
    assert [wrong for one in found for wrong in violations(compiled, one)] == []


def test_every_mix_element_is_valid(document) -> None:
    compiled = schema("mix20.xsd")
    found = parts(document, f"{MIX}mix")
    assert len(found) == 5  # two pages, three colour images of scans
    assert [wrong for one in found for wrong in violations(compiled, one)] == []


@pytest.mark.skipif(not shutil.which("tesseract"), reason="needs the system package tesseract-ocr")
def test_the_words_are_valid(volume) -> None:
    (words,) = (file for file in volume.files if file.role == Role.WORDS)
    assert violations(schema("alto-4-4.xsd"), words.path.read_bytes()) == []


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("mets-1-12-1.xsd", b'TYPE="PHYSICAL"', b'KIND="PHYSICAL"'),
        ("mets-1-12-1.xsd", b'CHECKSUMTYPE="SHA-512"', b'CHECKSUMTYPE="SHA-5"'),
        ("premis-v2-3.xsd", b"eventDateTime", b"eventTime"),
        ("mix20.xsd", b">SHA-512<", b">SHA-five<"),
    ],
)
def test_a_broken_rule_is_noticed(document, name, old, new) -> None:
    compiled = schema(name)
    tag = {"premis-v2-3.xsd": f"{PREMIS}event", "mix20.xsd": f"{MIX}mix"}.get(name)
    assert old in document
    broken = document.replace(old, new)
    found = parts(broken, tag) if tag else [broken]
    assert [wrong for one in found for wrong in violations(compiled, one)]


def test_it_refers_to_every_file_once_with_its_digest(document, volume) -> None:
    root = ElementTree.fromstring(document)
    found = {
        file.find(f"{METS}FLocat").get(f"{XLINK}href"): (file.get("CHECKSUM"), int(file.get("SIZE")))
        for file in root.iter(f"{METS}file")
    }
    assert found == {file.name: (file.sha512, file.size) for file in volume.files}
    ids = {file.get("ID") for file in root.iter(f"{METS}file")}
    assert {pointer.get("FILEID") for pointer in root.iter(f"{METS}fptr")} == ids


def test_every_reference_has_its_target(document) -> None:
    root = ElementTree.fromstring(document)
    ids = [element.get("ID") for element in root.iter() if element.get("ID")]
    assert len(ids) == len(set(ids))
    assert {name for element in root.iter() for name in (element.get("ADMID") or "").split()} <= set(ids)


def test_pages_stand_in_their_order_with_labels_and_sides(document) -> None:
    pages = [div for div in ElementTree.fromstring(document).iter(f"{METS}div") if div.get("TYPE") == "page"]
    assert [(div.get("ORDER"), div.get("ORDERLABEL"), div.get("LABEL")) for div in pages] == [
        ("1", "1r", "1r (right)"),
        ("2", "1v", "1v (left)"),
        ("3", "2r", "2r (right)"),
    ]


def test_an_event_says_what_it_read_and_made_and_with_which_parameters(document, volume) -> None:
    events = ElementTree.fromstring(document).iter(f"{PREMIS}event")
    (event,) = (one for one in events if one.findtext(f".//{PREMIS}eventIdentifierValue") == "000001")
    linked = {
        one.findtext(f"{PREMIS}linkingObjectIdentifierValue"): one.findtext(f"{PREMIS}linkingObjectRole")
        for one in event.iter(f"{PREMIS}linkingObjectIdentifier")
    }
    record = next(one for one in volume.events if one.identifier == "000001")
    assert linked == dict.fromkeys(record.sources, "source") | dict.fromkeys(record.results, "outcome")
    assert json.loads(event.findtext(f"{PREMIS}eventDetail"))["parameters"] == {"settings": {"dpi": DPI}}
    assert event.findtext(f"{PREMIS}eventDateTime") == NOW.isoformat()


def test_images_are_sampled_as_the_paper_was(document) -> None:
    ratios = [
        int(one.findtext(f"{MIX}numerator")) / int(one.findtext(f"{MIX}denominator"))
        for one in ElementTree.fromstring(document).iter(f"{MIX}xSamplingFrequency")
    ]
    assert ratios == [pytest.approx(DPI, abs=HALF_PIXEL_PER_METRE)] * 2


def test_the_title_is_as_it_was_given(document) -> None:
    assert ElementTree.fromstring(document).get("LABEL") == STRANGE


@given(text=st.text(max_size=40))
@settings(max_examples=25)
def test_any_text_makes_a_document(text) -> None:
    named = Volume("1", text, (), (), NOW, text, text)
    root = ElementTree.fromstring(encode_mets(named, {}, now=NOW))
    title = next(one for one in root.iter() if one.tag.endswith("}title"))
    assert (title.text or "").replace("\n", "") == clean(text).replace("\r", "").replace("\n", "")


def test_parts_stand_alone(volume) -> None:
    file, event = next(volume.files), dataclasses.replace(volume.events[0], facts={})
    for made in (encode_object(file), encode_event(event), *encode_agents(volume).values()):
        assert ElementTree.fromstring(encode(made)) is not None


def test_an_image_that_the_disk_does_not_give_back_is_the_disks_fault(tmp_path, monkeypatch) -> None:
    (tmp_path / "no.png").write_bytes(b"no image")
    with pytest.raises(BadInput, match="is not an image"):
        read_image_facts(tmp_path / "no.png")

    def refuse(_file: object) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(mix.Image, "open", refuse)
    with pytest.raises(OSError, match="Input/output error"):
        read_image_facts(tmp_path / "no.png")
