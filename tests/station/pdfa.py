"""What ISO 19005-2:2011 (PDF/A-2, level B) asks of a page of picture and invisible text, clause by clause.

No validator: of the standard, these are the rules that a file of this kind could break. Numbers are its clauses.
"""

from __future__ import annotations

import io
import re
import struct
from collections.abc import Callable, Iterator
from typing import Any

import pikepdf

Check = Callable[[bytes, pikepdf.Pdf], Iterator[str]]

FILTERS = {"/FlateDecode", "/DCTDecode", "/JPXDecode", "/CCITTFaxDecode", "/JBIG2Decode", "/RunLengthDecode"}
TEXT_FILTERS = {"/ASCIIHexDecode", "/ASCII85Decode"}
STATE, SHOWN = {"q", "Q", "cm", "gs", "w", "J", "j", "M", "d", "i"}, {"Do", "g", "rg", "k", "G", "RG", "K"}
TEXT = {"BT", "ET", "Tf", "Tr", "Tz", "Tm", "Td", "TD", "T*", "Tj", "TJ", "Tc", "Tw", "TL", "Ts"}
MARKS = {"BMC", "BDC", "EMC"}
OPERATORS = STATE | SHOWN | TEXT | MARKS  # no others have anything to do on such a page
ACTIONS = ("OpenAction", "AA", "Names", "AcroForm", "Requirements", "Perms", "OCProperties")
DEEPEST, MIN_UNITS, MAX_UNITS = 28, 3, 14_400  # 6.1.13
DEVICES, SPACES = {b"mntr", b"prtr"}, {b"RGB ": 3, b"GRAY": 1, b"CMYK": 4}
WIDTH_UNITS = 1.0  # 6.2.11.5: thousandths of an em
XMP = {  # 6.6.2.3: properties of schemas that need no description of their own
    "{http://purl.org/dc/elements/1.1/}title",
    "{http://ns.adobe.com/xap/1.0/}CreatorTool",
    "{http://www.aiim.org/pdfa/ns/id/}part",
    "{http://www.aiim.org/pdfa/ns/id/}conformance",
}


def violations(data: bytes) -> list[str]:
    """The clauses that a file breaks, each with what is wrong."""
    with pikepdf.open(io.BytesIO(data)) as pdf:
        return [f"{clause}: {wrong}" for clause, check in CLAUSES.items() for wrong in check(data, pdf)]


def _header(data: bytes, _: pikepdf.Pdf) -> Iterator[str]:
    if not re.match(rb"%PDF-1\.[0-7]\r?\n%[\x80-\xff]{4}", data):
        yield "no header with four bytes above 127 in its second line"


def _trailer(data: bytes, pdf: pikepdf.Pdf) -> Iterator[str]:
    if "/ID" not in pdf.trailer or len(pdf.trailer.ID) != 2:
        yield "no file identifier"
    if "/Encrypt" in pdf.trailer:
        yield "encrypted"
    if not re.search(rb"%%EOF\r?\n?\Z", data):
        yield "something after the end"


def _streams(_: bytes, pdf: pikepdf.Pdf) -> Iterator[str]:
    for stream in _of(pdf, pikepdf.Stream):
        if {"/F", "/FFilter", "/FDecodeParms"} & set(stream.keys()):
            yield "a stream outside the file"
        filters = stream.get("/Filter", pikepdf.Array([]))
        names = {str(name) for name in (filters if isinstance(filters, pikepdf.Array) else [filters])}
        if names - FILTERS - TEXT_FILTERS:
            yield f"filter {names}"


def _limits(_: bytes, pdf: pikepdf.Pdf) -> Iterator[str]:
    for page in pdf.pages:
        sides = [float(page.MediaBox[2] - page.MediaBox[0]), float(page.MediaBox[3] - page.MediaBox[1])]
        if not all(MIN_UNITS <= side <= MAX_UNITS for side in sides):
            yield f"a page of {sides} units"
        depth = 0
        for instruction in pikepdf.parse_content_stream(page):
            depth += {"q": 1, "Q": -1}.get(str(instruction.operator), 0)
            if depth > DEEPEST or depth < 0:
                yield "graphics states nested too deep, or closed before they are opened"
        if depth:
            yield "a graphics state that stays open"


def _content(_: bytes, pdf: pikepdf.Pdf) -> Iterator[str]:
    for page in pdf.pages:
        if "/Resources" not in page:
            yield "a page without resources of its own"
        found = {str(instruction.operator) for instruction in pikepdf.parse_content_stream(page)}
        if found - OPERATORS:
            yield f"operators {found - OPERATORS}"


def _intent(_: bytes, pdf: pikepdf.Pdf) -> Iterator[str]:
    intents = [one for one in pdf.Root.get("/OutputIntents", pikepdf.Array([])) if one.S == "/GTS_PDFA1"]
    if len(intents) != 1 or "/DestOutputProfile" not in intents[0]:
        yield "no one PDF/A output intent with its profile"
        return
    yield from _profile(intents[0].DestOutputProfile)


def _profile(stream: Any) -> Iterator[str]:
    profile = stream.read_bytes()
    if profile[36:40] != b"acsp" or profile[8] > 4 or struct.unpack(">I", profile[:4])[0] != len(profile):
        yield "a profile that is not an ICC profile up to version 4"
    if profile[12:16] not in DEVICES | {b"scnr", b"spac"} or SPACES.get(profile[16:20]) != int(stream.N):
        yield "a profile of another device class, or of another number of channels than it says"


def _colours(_: bytes, pdf: pikepdf.Pdf) -> Iterator[str]:
    profile = pdf.Root.OutputIntents[0].DestOutputProfile.read_bytes() if "/OutputIntents" in pdf.Root else b""
    for image in _of(pdf, pikepdf.Stream):
        if image.get("/Subtype") != "/Image":
            continue
        space = image.ColorSpace
        if space == "/DeviceRGB" and profile[16:20] != b"RGB ":
            yield "an image in device colours that no output intent tells of"
        elif isinstance(space, pikepdf.Array) and space[0] == "/ICCBased":
            yield from _profile(space[1])
        if {"/Alternates", "/OPI"} & set(image.keys()) or image.get("/Interpolate", False):
            yield "an image with alternates, or interpolated"


def _transparency(_: bytes, pdf: pikepdf.Pdf) -> Iterator[str]:
    for thing in _of(pdf, pikepdf.Dictionary, pikepdf.Stream):
        if "/SMask" in thing or thing.get("/CA", 1) != 1 or thing.get("/ca", 1) != 1 or "/Group" in thing:
            yield "transparency, on a page that is a picture"


def _fonts(_: bytes, pdf: pikepdf.Pdf) -> Iterator[str]:
    for font in _of(pdf, pikepdf.Dictionary):
        if font.get("/Type") != "/Font" or font.Subtype == "/CIDFontType2":
            continue
        if font.Subtype != "/Type0" or font.Encoding != "/Identity-H":
            yield f"a font of the kind {font.Subtype}"
            continue
        if "/ToUnicode" not in font:
            yield "a font without Unicode values (6.2.11.7)"
        yield from _cid_font(font.DescendantFonts[0])


def _cid_font(font: Any) -> Iterator[str]:
    if "/FontFile2" not in font.FontDescriptor:
        yield "a font that is not embedded (6.2.11.4)"
        return
    if "/CIDToGIDMap" not in font:
        yield "no map from characters to glyphs (6.2.11.3.2)"
        return
    glyphs = {glyph for (glyph,) in struct.iter_unpack(">H", font.CIDToGIDMap.read_bytes())}
    if 0 in glyphs:
        yield "characters without a glyph (6.2.11.8)"
    widths = _advances(font.FontDescriptor.FontFile2.read_bytes())
    if "/W" in font or any(abs(widths[glyph] - float(font.DW)) > WIDTH_UNITS for glyph in glyphs):
        yield "widths that are not those of the font (6.2.11.5)"


def _advances(font: bytes) -> list[float]:
    """The widths of all glyphs of a TrueType font, in thousandths of an em (its tables head, hhea and hmtx)."""
    (count,) = struct.unpack_from(">H", font, 4)
    tables = {name: at for name, _, at, _ in struct.iter_unpack(">4sIII", font[12 : 12 + 16 * count])}
    (em,), (widths,) = (
        struct.unpack_from(">H", font, tables[b"head"] + 18),
        struct.unpack_from(">H", font, tables[b"hhea"] + 34),
    )
    metrics = font[tables[b"hmtx"] : tables[b"hmtx"] + 4 * widths]
    return [1000 * width / em for width, _ in struct.iter_unpack(">Hh", metrics)]


def _actions(_: bytes, pdf: pikepdf.Pdf) -> Iterator[str]:
    for key in ACTIONS:
        if f"/{key}" in pdf.Root:
            yield f"the catalogue has {key}"
    for page in pdf.pages:
        if {"/AA", "/Annots", "/PresSteps"} & set(page.keys()):
            yield "a page with actions or annotations"
    for thing in _of(pdf, pikepdf.Dictionary):
        if thing.get("/Type") in ("/Filespec", "/Action") or "/JS" in thing or "/EF" in thing:
            yield "an embedded file, or an action"


def _metadata(_: bytes, pdf: pikepdf.Pdf) -> Iterator[str]:
    if "/Metadata" not in pdf.Root:
        yield "no metadata"
        return
    stream = pdf.Root.Metadata
    if "/Filter" in stream or stream.get("/Type") != "/Metadata" or stream.get("/Subtype") != "/XML":
        yield "metadata compressed, or not said to be XML"
    packet = stream.read_raw_bytes()
    if re.search(rb"<\?xpacket[^>]*(bytes|encoding)=", packet) or not packet.startswith(b"<?xpacket"):
        yield "a packet header with bytes or encoding"
    found = pdf.open_metadata()
    if found.pdfa_status != "2B":
        yield f"it says {found.pdfa_status!r}, not 2B (6.6.4)"
    if set(found) - XMP:
        yield f"properties of other schemas: {set(found) - XMP}"
    if "/Info" in pdf.trailer and len(pdf.docinfo):
        yield "an information dictionary, which would have to agree"


def _of(pdf: pikepdf.Pdf, *kinds: type) -> Iterator[Any]:
    """Every object of the file of these kinds, within others too."""
    waiting: list[Any] = list(pdf.objects)
    while waiting:
        thing = waiting.pop()
        if isinstance(thing, pikepdf.Array):
            waiting.extend(one for one in thing if not getattr(one, "is_indirect", False))
        elif isinstance(thing, pikepdf.Dictionary | pikepdf.Stream):
            if isinstance(thing, kinds):
                yield thing
            values = (thing[key] for key in set(thing.keys()))
            waiting.extend(value for value in values if not getattr(value, "is_indirect", False))


CLAUSES: dict[str, Check] = {
    "6.1.2 header": _header,
    "6.1.3 trailer": _trailer,
    "6.1.7 streams": _streams,
    "6.1.13 limits": _limits,
    "6.2.2 content": _content,
    "6.2.3 output intent": _intent,
    "6.2.4 colours and 6.2.8 images": _colours,
    "6.2.10 transparency": _transparency,
    "6.2.11 fonts": _fonts,
    "6.3 to 6.11 actions, files, forms": _actions,
    "6.6 metadata": _metadata,
}
