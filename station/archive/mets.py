"""METS 1.12.1: one document that holds a volume together.

Files, technical metadata, events, order of the pages.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import datetime
from urllib.parse import quote
from xml.etree.ElementTree import Element

from station.archive.mix import ImageFacts, encode_mix
from station.archive.premis import encode_agents, encode_event, encode_object
from station.archive.volume import Event, Page, Role, StoredFile, Volume
from station.archive.xml import DC, METS, XLINK, XSI, element, encode, optional
from station.images.image_metadata import software

SCHEMA = "http://www.loc.gov/METS/ http://www.loc.gov/standards/mets/mets.xsd"
DESCRIPTION = "description"  # identifiers of XML (NCName): words, numbers and dots


def encode_mets(volume: Volume, images: Mapping[str, ImageFacts], *, now: datetime) -> bytes:
    """Encode the document of a volume.

    It refers to the files by their names, relative to itself.
    images: facts of the image files, by their names.
    now: when the document is made.
    """
    ids = {file.name: f"file.{number}" for number, file in enumerate(volume.files, 1)}
    root = element(
        f"{METS}mets",
        _header(volume, now),
        _description(volume),
        element(f"{METS}amdSec", _technical(volume, images, ids), _events(volume), ID="administration"),
        element(f"{METS}fileSec", _groups(volume, images, ids)),
        _structure(volume, ids),
        OBJID=volume.identifier,
        LABEL=volume.title,
        TYPE="volume",
    )
    root.set(f"{XSI}schemaLocation", SCHEMA)
    return encode(root)


def _header(volume: Volume, now: datetime) -> Element:
    return element(
        f"{METS}metsHdr",
        element(
            f"{METS}agent",
            element(f"{METS}name", software()),
            ROLE="CREATOR",
            TYPE="OTHER",
            OTHERTYPE="SOFTWARE",
        ),
        element(f"{METS}agent", element(f"{METS}name", volume.organisation), ROLE="CUSTODIAN", TYPE="ORGANIZATION")
        if volume.organisation
        else None,
        CREATEDATE=now.isoformat(timespec="seconds"),
    )


def _description(volume: Volume) -> Element:
    """Title, identifier and collection in Dublin Core."""
    data = element(
        f"{METS}xmlData",
        element(f"{DC}title", volume.title),
        element(f"{DC}identifier", volume.identifier),
        optional(f"{DC}relation", volume.project),
        optional(f"{DC}publisher", volume.organisation),
        element(f"{DC}date", volume.created.date().isoformat()),
    )
    return element(f"{METS}dmdSec", element(f"{METS}mdWrap", data, MDTYPE="DC"), ID=DESCRIPTION)


def _technical(volume: Volume, images: Mapping[str, ImageFacts], ids: Mapping[str, str]) -> Iterator[Element]:
    """What each file is (PREMIS), and of images how they were sampled (MIX)."""
    provenance = {file.name: page.provenance for page in volume.pages for file in page.files}
    for file in volume.files:
        yield _section("techMD", f"object.{ids[file.name]}", "PREMIS:OBJECT", encode_object(file))
        if file.name in images:
            image = encode_mix(file, images[file.name], provenance[file.name])
            yield _section("techMD", f"image.{ids[file.name]}", "NISOIMG", image)


def _events(volume: Volume) -> Iterator[Element]:
    for event in volume.events:
        yield _section("digiprovMD", _event_id(event), "PREMIS:EVENT", encode_event(event))
    for number, agent in enumerate(encode_agents(volume).values(), 1):
        yield _section("digiprovMD", f"agent.{number}", "PREMIS:AGENT", agent)


def _section(kind: str, identifier: str, scheme: str, content: Element) -> Element:
    wrapped = element(f"{METS}mdWrap", element(f"{METS}xmlData", content), MDTYPE=scheme)
    return element(f"{METS}{kind}", wrapped, ID=identifier)


def _groups(volume: Volume, images: Mapping[str, ImageFacts], ids: Mapping[str, str]) -> Iterator[Element]:
    """The files by what they are to the archive."""
    events = {event.identifier: _event_id(event) for event in volume.events}
    for role in Role:
        files = [file for file in volume.files if file.role == role]
        if files:
            group = (_file(file, ids[file.name], events, image=file.name in images) for file in files)
            yield element(f"{METS}fileGrp", group, USE=role.value)


def _file(file: StoredFile, identifier: str, events: Mapping[str, str], *, image: bool) -> Element:
    sections = [f"object.{identifier}", *([f"image.{identifier}"] if image else [])]
    sections += [events[file.event]] if file.event in events else []
    location = element(f"{METS}FLocat", LOCTYPE="URL")
    location.set(f"{XLINK}href", quote(file.name))
    return element(
        f"{METS}file",
        location,
        ID=identifier,
        MIMETYPE=file.media_type,
        SIZE=file.size,
        CHECKSUM=file.sha512,
        CHECKSUMTYPE="SHA-512",
        ADMID=" ".join(sections),
    )


def _structure(volume: Volume, ids: Mapping[str, str]) -> Element:
    pages = (_page(page, ids) for page in volume.pages)
    sequence = element(f"{METS}div", pages, TYPE="physSequence", LABEL=volume.title, DMDID=DESCRIPTION)
    return element(f"{METS}structMap", sequence, TYPE="PHYSICAL")


def _page(page: Page, ids: Mapping[str, str]) -> Element:
    pointers = (element(f"{METS}fptr", FILEID=ids[file.name]) for file in page.files)
    label = f"{page.label} ({page.side})" if page.side else page.label
    return element(f"{METS}div", pointers, TYPE="page", ORDER=page.number, ORDERLABEL=page.label, LABEL=label)


def _event_id(event: Event) -> str:
    return f"event.{event.identifier}"
