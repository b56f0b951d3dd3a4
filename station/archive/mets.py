"""METS 1.12.1: a volume's files, technical metadata, events and order of pages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import datetime
from urllib.parse import quote
from xml.etree.ElementTree import Element

from station.archive.mix import ImageFacts, encode_mix
from station.archive.mods import encode_mods
from station.archive.premis import encode_agents, encode_event, encode_object
from station.archive.volume import Event, Page, Role, StoredFile, Volume
from station.archive.xml import DC, METS, XLINK, XSI, element, encode, optional
from station.images.image_metadata import software

SCHEMA = "http://www.loc.gov/METS/ http://www.loc.gov/standards/mets/mets.xsd"
CATALOGUE = "catalogue"
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
        _catalogue(volume),
        element(f"{METS}amdSec", _technical(volume, images, ids), _events(volume), ID="administration"),
        element(f"{METS}fileSec", _groups(volume, images, ids)),
        _structure(volume, images, ids),
        _sections(volume),
        _links(volume),
        OBJID=volume.identifier,
        LABEL=volume.title,
        TYPE="volume",
    )
    root.set(f"{XSI}schemaLocation", SCHEMA)
    return encode(root)


def _header(volume: Volume, now: datetime) -> Element:
    owner = volume.about.owner or volume.organisation
    return element(
        f"{METS}metsHdr",
        element(
            f"{METS}agent",
            element(f"{METS}name", software()),
            ROLE="CREATOR",
            TYPE="OTHER",
            OTHERTYPE="SOFTWARE",
        ),
        element(f"{METS}agent", element(f"{METS}name", owner), ROLE="CUSTODIAN", TYPE="ORGANIZATION")
        if owner
        else None,
        CREATEDATE=now.isoformat(timespec="seconds"),
    )


def _description(volume: Volume) -> Element:
    """What is known of the volume in Dublin Core."""
    about = volume.about
    data = element(
        f"{METS}xmlData",
        element(f"{DC}title", about.title or volume.title),
        [element(f"{DC}creator", creator) for creator in about.creators],
        element(f"{DC}identifier", volume.identifier),
        [element(f"{DC}identifier", one.value) for one in about.identifiers],
        optional(f"{DC}source", about.shelfmark),
        optional(f"{DC}language", about.language),
        optional(f"{DC}format", about.extent),
        optional(f"{DC}rights", about.rights),
        optional(f"{DC}relation", volume.project),
        optional(f"{DC}publisher", about.publisher or volume.organisation),
        element(f"{DC}date", about.date or volume.created.date().isoformat()),
    )
    return element(f"{METS}dmdSec", element(f"{METS}mdWrap", data, MDTYPE="DC"), ID=DESCRIPTION)


def _catalogue(volume: Volume) -> Element | None:
    """What is known of the volume in MODS; None without a description."""
    if not volume.about.given():
        return None
    data = element(f"{METS}xmlData", encode_mods(volume.about))
    return element(f"{METS}dmdSec", element(f"{METS}mdWrap", data, MDTYPE="MODS"), ID=CATALOGUE)


def _described(volume: Volume) -> str:
    """Return the identifiers of the descriptions of the volume."""
    return f"{DESCRIPTION} {CATALOGUE}" if volume.about.given() else DESCRIPTION


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


def _structure(volume: Volume, images: Mapping[str, ImageFacts], ids: Mapping[str, str]) -> Element:
    pages = (_page(page, images, ids) for page in volume.pages)
    sequence = element(
        f"{METS}div", pages, TYPE="physSequence", LABEL=volume.title, DMDID=_described(volume), ID=_div_id("sequence")
    )
    return element(f"{METS}structMap", sequence, TYPE="PHYSICAL")


def _page(page: Page, images: Mapping[str, ImageFacts], ids: Mapping[str, str]) -> Element:
    pointers = (_pointer(page, file, images.get(file.name), ids[file.name]) for file in page.files)
    labels = {"ORDERLABEL": page.label} if page.label else {}
    label = " ".join(filter(None, (page.label or page.kind, f"({page.side})" if page.side else "")))
    labels |= {"LABEL": label} if label else {}
    return element(f"{METS}div", pointers, TYPE="page", ORDER=page.number, ID=_div_id(page.number), **labels)


def _pointer(page: Page, file: StoredFile, image: ImageFacts | None, identifier: str) -> Element:
    """Refer to a file; to the part of it that a leaf side is, where the image shows both."""
    if image is None or file.role is not Role.ORIGINAL or not page.spine:
        return element(f"{METS}fptr", FILEID=identifier)
    coordinates = ",".join(f"{value}" for point in leaf_polygon(page, image.width, image.height) for value in point)
    area = element(f"{METS}area", FILEID=identifier, SHAPE="POLY", COORDS=coordinates)
    return element(f"{METS}fptr", area)


def leaf_polygon(page: Page, width: int, height: int) -> list[tuple[int, int]]:
    """Return the corners of the part of an image, in pixels, that a leaf side is.

    Its spine goes on straight to the upper and lower edge of the image.
    """
    (x0, y0), (x1, y1) = page.spine[0], page.spine[-1]
    slope = (x1 - x0) / (y1 - y0) if y1 != y0 else 0.0
    ends = (x0 - slope * y0, 0.0), (x1 + slope * (height - 1 - y1), height - 1.0)
    line = [ends[0], *page.spine, ends[1]]
    spine = [(min(max(round(x), 0), width - 1), min(max(round(y), 0), height - 1)) for x, y in line]
    far = 0 if page.part == "left" else width - 1
    return [(far, 0), *dict.fromkeys(spine), (far, height - 1)]


def _sections(volume: Volume) -> Element | None:
    """The runs of labels, covers and inserts as the logical structure."""
    if not volume.sections:
        return None
    kinds = (
        element(
            f"{METS}div",
            TYPE=section.kind,
            LABEL=section.label,
            ORDER=number,
            ID=_div_id(f"section.{number}"),
        )
        for number, section in enumerate(volume.sections, 1)
    )
    whole = element(
        f"{METS}div", kinds, TYPE="volume", LABEL=volume.title, DMDID=_described(volume), ID=_div_id("volume")
    )
    return element(f"{METS}structMap", whole, TYPE="LOGICAL")


def _links(volume: Volume) -> Element | None:
    """Which pages each section has, and that the volume is the whole sequence."""
    if not volume.sections:
        return None
    pairs = [("volume", "sequence")]
    pairs += [(f"section.{n}", str(page)) for n, section in enumerate(volume.sections, 1) for page in section.pages]
    return element(f"{METS}structLink", [_link(*pair) for pair in pairs])


def _link(logical: str, physical: str) -> Element:
    link = element(f"{METS}smLink")
    link.set(f"{XLINK}from", _div_id(logical))
    link.set(f"{XLINK}to", _div_id(physical))
    return link


def _div_id(name: str | int) -> str:
    return f"div.{name}"


def _event_id(event: Event) -> str:
    return f"event.{event.identifier}"
