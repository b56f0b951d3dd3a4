"""ALTO 4.4 of an exported page: its place in the volume, its printed number, its side.

Labels may change after a page was read, so that they are written into the exported copy.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from functools import partial

from lxml import etree

from restore import BadInput
from station.archive.volume import Event, Page, Role, StoredFile, Volume
from station.images.image_metadata import software

SPACE = "{http://www.loc.gov/standards/alto/ns-v4#}"
POSITIONS: Mapping[str, str] = {"cover": "Cover", "foldout": "Foldout"}
SIDES: Mapping[str, str] = {"left": "Left", "right": "Right", "": "Single"}

EVENT = "places"  # identifier of the event that wrote places into words


def with_placed_words(volume: Volume, now: datetime) -> Volume:
    """Return the volume as an export has it: its words with the places of their pages.

    The event that wrote them is added. Raises BadInput for words that are damaged, OSError.
    """
    pages = tuple(_with_placed_words(page) for page in volume.pages)
    names = tuple(file.name for page in pages for file in page.files if file.made is not None)
    if not names:
        return volume
    detail = "place, printed number and side of each page written into its ALTO file"
    event = Event(EVENT, "modification", now, software(), detail, names, names)
    return replace(volume, pages=pages, events=(*volume.events, event))


def _with_placed_words(page: Page) -> Page:
    """Return the page with its words as an export has them."""
    files = tuple(_placed_file(file, page) if file.role is Role.WORDS else file for file in page.files)
    return replace(page, files=files)


def _placed_file(file: StoredFile, page: Page) -> StoredFile:
    made = partial(_placed_content, file, page)
    data = made()
    return replace(file, sha512=hashlib.sha512(data).hexdigest(), size=len(data), made=made)


def _placed_content(file: StoredFile, page: Page) -> bytes:
    data = file.path.read_bytes()
    if hashlib.sha512(data).hexdigest() != file.sha512:
        raise BadInput(f"{file.path} is damaged: its digest has changed", "see planish verify")
    return placed_alto(data, page)


def placed_alto(data: bytes, page: Page) -> bytes:
    """Return an ALTO file with the place of its page in the volume.

    Raises BadInput for a file that is not ALTO.
    """
    try:
        root = etree.fromstring(data, etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False))
    except etree.XMLSyntaxError as error:
        raise BadInput(f"the words of page {page.name} are damaged: {error}", "see planish verify") from error
    for element in root.iter(f"{SPACE}Page"):
        element.set("PHYSICAL_IMG_NR", str(page.number))
        if page.label:
            element.set("PRINTED_IMG_NR", page.label)
        element.set("POSITION", POSITIONS.get(page.kind, SIDES[page.side]))
        if page.kind:
            element.set("PAGECLASS", page.kind)
    encoded: bytes = etree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return encoded
