"""Read the description of a volume from MODS, Dublin Core or TOML."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from lxml import etree

from restore import BadInput
from station.session.terms.about import About, about_from
from station.storage.given_file import read_given

MAX_DOTS = 1000  # in a line: the memory that a dotted key takes grows with their square
MAX_BYTES = 2**20  # of a file: a record of a library catalogue has some kilobytes
MODS = "http://www.loc.gov/mods/v3"
DC = "http://purl.org/dc/elements/1.1/"
NAMES = {"m": MODS, "dc": DC, "xlink": "http://www.w3.org/1999/xlink"}
HINT = "give a file of MODS 3, Dublin Core or TOML"
ADDRESS = re.compile(r"https?://\S+")
# ISO 639-2/B, which catalogues have, where BCP 47 has another code than its first two letters or that of 639-2/T.
LANGUAGES = {
    **{"ger": "de", "fre": "fr", "dut": "nl", "gre": "el", "cze": "cs", "slo": "sk", "rum": "ro", "alb": "sq"},
    **{"arm": "hy", "baq": "eu", "bur": "my", "chi": "zh", "geo": "ka", "ice": "is", "mac": "mk", "may": "ms"},
    **{"per": "fa", "tib": "bo", "wel": "cy", "lat": "la", "eng": "en", "ita": "it", "spa": "es", "heb": "he"},
    **{"ara": "ar", "por": "pt", "pol": "pl", "rus": "ru", "swe": "sv", "dan": "da", "hun": "hu", "tur": "tr"},
}


def read_about(path: Path) -> About:
    """Read the description of a volume from a file: `.toml`, else XML.

    Raises BadInput for a file that cannot be read, and for one of another kind.
    """
    data = read_given(path, MAX_BYTES, str(path), HINT)
    if path.suffix.lower() == ".toml":
        try:
            if any(line.count(b".") > MAX_DOTS for line in data.splitlines()):
                raise BadInput(f"{path}: a line holds more than {MAX_DOTS} dots", HINT)
            return about_from(tomllib.loads(data.decode()), str(path))
        except RecursionError as error:
            raise BadInput(f"{path}: its values are nested too deeply", HINT) from error
        except ValueError as error:  # TOMLDecodeError, UnicodeDecodeError
            raise BadInput(f"{path} is not a TOML file: {error}", HINT) from error
    return about_from(_of_xml(data, path), str(path))


def _of_xml(data: bytes, path: Path) -> dict[str, Any]:
    """Return the fields in a document; entities and document types are refused."""
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False)
    try:
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise BadInput(f"{path} is not XML: {error}", HINT) from error
    if root.getroottree().docinfo.doctype:
        raise BadInput(f"{path} has a document type, which may hold entities", "remove its DOCTYPE")
    record = root if root.tag == f"{{{MODS}}}mods" else root.find(".//m:mods", NAMES)
    if record is not None:
        return _filled(_mods(record))
    if root.find(".//dc:*", NAMES) is not None:
        return _filled(_dublin_core(root))
    raise BadInput(f"{path} holds neither MODS nor Dublin Core", HINT)


def _mods(record: Any) -> Iterator[tuple[str, Any]]:
    """Yield the fields of a record of MODS 3, as the Library of Congress defines its elements."""
    title = record.xpath("m:titleInfo[not(@type)]", namespaces=NAMES)
    if title:
        before, name, after = (_text(title[0], f"m:{part}") for part in ("nonSort", "title", "subTitle"))
        yield "title", f"{before} {name}".strip() + (f": {after}" if after else "")
    yield (
        "creators",
        [" ".join(_all(name, "m:namePart[not(@type='date')]")) for name in record.findall("m:name", NAMES)],
    )
    origin = "m:originInfo"
    yield "date", _text(record, f"{origin}/m:dateIssued") or _text(record, f"{origin}/m:dateCreated")
    yield "place", _text(record, f"{origin}/m:place/m:placeTerm[not(@type='code')]")
    yield "publisher", _text(record, f"{origin}/m:publisher")
    yield "language", _language(_text(record, "m:language/m:languageTerm[@type='code']"))
    yield "extent", _text(record, "m:physicalDescription/m:extent")
    yield "owner", _text(record, ".//m:location/m:physicalLocation")
    yield "shelfmark", _text(record, ".//m:location//m:shelfLocator")
    rights = record.xpath("m:accessCondition/@xlink:href", namespaces=NAMES)
    yield "rights", rights[0] if rights else _address(_text(record, "m:accessCondition"))
    found = record.xpath("m:identifier[not(@invalid='yes')]", namespaces=NAMES)
    yield "identifiers", [_identifier(one.get("type", ""), _content(one)) for one in found]


def _dublin_core(root: Any) -> Iterator[tuple[str, Any]]:
    """Yield the fields in the elements of Dublin Core 1.1."""
    for field, name in (("title", "title"), ("date", "date"), ("publisher", "publisher"), ("extent", "format")):
        yield field, _text(root, f".//dc:{name}")
    yield "creators", _all(root, ".//dc:creator")
    yield "language", _language(_text(root, ".//dc:language"))
    yield "rights", next(filter(None, map(_address, _all(root, ".//dc:rights"))), "")
    yield "identifiers", [_identifier("", value) for value in _all(root, ".//dc:identifier")]


def _filled(fields: Iterator[tuple[str, Any]]) -> dict[str, Any]:
    """Return the fields that are not empty."""
    return {
        name: kept
        for name, value in fields
        if (kept := [one for one in value if one and one != {"value": ""}] if isinstance(value, list) else value)
    }


def _identifier(scheme: str, value: str) -> Mapping[str, str]:
    return {"scheme": scheme, "value": value} if scheme else {"value": value}


def _language(code: str) -> str:
    """Return the code of BCP 47 for one of ISO 639; empty for what is not a code."""
    short = LANGUAGES.get(code.lower(), code)
    return short if re.fullmatch(r"[A-Za-z]{2,3}(-[A-Za-z0-9]{1,8})*", short) else ""


def _address(text: str) -> str:
    found = ADDRESS.search(text)
    return found[0] if found else ""


def _text(element: Any, path: str) -> str:
    return next(iter(_all(element, path)), "")


def _all(element: Any, path: str) -> list[str]:
    found = element.xpath(path, namespaces=NAMES)
    return [text for one in found if (text := _content(one))]


def _content(element: Any) -> str:
    """Return the text of an element, white space as one blank."""
    return " ".join("".join(element.itertext()).split())
