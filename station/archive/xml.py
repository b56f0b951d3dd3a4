"""XML elements from text and numbers; characters that XML cannot hold are replaced."""

from __future__ import annotations

import re
from collections.abc import Iterable
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

METS = "{http://www.loc.gov/METS/}"
PREMIS = "{info:lc/xmlns/premis-v2}"
MIX = "{http://www.loc.gov/mix/v20}"
DC = "{http://purl.org/dc/elements/1.1/}"
MODS = "{http://www.loc.gov/mods/v3}"
XLINK = "{http://www.w3.org/1999/xlink}"
XSI = "{http://www.w3.org/2001/XMLSchema-instance}"
PREFIXES = {"mets": METS, "premis": PREMIS, "mix": MIX, "dc": DC, "mods": MODS, "xlink": XLINK, "xsi": XSI}
FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # XML 1.0, production 2

Content = Element | str | int | float | None


def element(tag: str, *content: Content | Iterable[Element], **attributes: str | int) -> Element:
    """An element with children and text; None among them is left out."""
    made = Element(tag, {name: clean(str(value)) for name, value in attributes.items()})
    for part in content:
        if isinstance(part, Element):
            made.append(part)
        elif isinstance(part, str | int | float):
            made.text = clean(f"{part}")
        elif part is not None:
            made.extend(part)
    return made


def optional(tag: str, text: str | None) -> Element | None:
    """An element with a text, None without."""
    return element(tag, text) if text else None


def clean(text: str) -> str:
    """The text with U+FFFD for every character that XML cannot hold."""
    return FORBIDDEN.sub("\ufffd", text)


def encode(root: Element) -> bytes:
    """The document as UTF-8."""
    for prefix, space in PREFIXES.items():
        ElementTree.register_namespace(prefix, space.strip("{}"))
    ElementTree.indent(root)
    encoded: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return encoded + b"\n"
