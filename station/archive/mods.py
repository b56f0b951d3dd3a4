"""MODS 3: what is known of a volume, as libraries exchange it."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from station.archive.xml import MODS, XLINK, element, optional
from station.session.terms.about import About


def encode_mods(about: About) -> Element:
    """Return the description of a volume as a record of MODS."""
    codes = {"type": "code", "authority": "rfc3066"}  # the name that MODS has for tags of BCP 47
    rights = element(f"{MODS}accessCondition", type="use and reproduction")
    rights.set(f"{XLINK}href", about.rights)
    return element(
        f"{MODS}mods",
        _group("titleInfo", optional(f"{MODS}title", about.title)),
        [element(f"{MODS}name", element(f"{MODS}namePart", name)) for name in about.creators],
        _group(
            "originInfo",
            _group("place", element(f"{MODS}placeTerm", about.place, type="text") if about.place else None),
            optional(f"{MODS}publisher", about.publisher),
            optional(f"{MODS}dateIssued", about.date),
        ),
        _group("language", element(f"{MODS}languageTerm", about.language, **codes) if about.language else None),
        _group("physicalDescription", optional(f"{MODS}extent", about.extent)),
        [
            element(f"{MODS}identifier", one.value, **({"type": one.scheme} if one.scheme else {}))
            for one in about.identifiers
        ],
        _group(
            "location",
            optional(f"{MODS}physicalLocation", about.owner),
            optional(f"{MODS}shelfLocator", about.shelfmark),
        ),
        rights if about.rights else None,
        version="3.7",
    )


def _group(name: str, *children: Element | None) -> Element | None:
    """Return an element with children, None without any."""
    kept = [child for child in children if child is not None]
    return element(f"{MODS}{name}", kept) if kept else None
