"""Gathers all that a glTF file refers to in one header and one binary chunk, as .glb.

Buffers and pictures may be in the binary chunk, in the header as data URIs, or in separate files.
"""

from __future__ import annotations

import base64
import binascii
import json
import re
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from restore.errors import BadInput
from restore.formats.parsing.source import DAMAGED, MAX_FILE_BYTES, NEXT_TO_SCAN, ONE_SHOT, find_reference, read_bytes

MAX_NAME = 80  # characters of a name in a message
# The header of one textured mesh is a page of text with a node or two; an editor adds some dozens.
MAX_HEADER_BYTES = 2**20
PLAIN = "export it as a plain, uncompressed .glb"
_DATA = re.compile(rb'"data:[^"]*"')
_ENCODED = re.compile(r"data:[^,]*;base64,")


def gathered(path: Path, header: bytes, binary: bytes | None) -> tuple[bytes, bytes]:
    """Return header and binary chunk, with buffers and pictures in that.

    Raises BadInput.
    """
    if len(header) > MAX_HEADER_BYTES and len(_DATA.sub(b"", header)) > MAX_HEADER_BYTES:
        raise BadInput(f"{path} is not made of a JSON header and a binary chunk", DAMAGED)
    try:
        described = json.loads(header)
        parts = _Parts()
        starts = [parts.add(_buffer(path, buffer, binary)) for buffer in described.get("buffers", [])]
        views = described.setdefault("bufferViews", [])
        for number, view in enumerate(views):
            view["byteOffset"] = _start(path, number, view, starts)
            view["buffer"] = 0
        for image in described.get("images", []):
            if "uri" in image and (data := _content(path, image.pop("uri"))) is not None:
                views.append({"buffer": 0, "byteOffset": parts.add(data), "byteLength": len(data)})
                image["bufferView"] = len(views) - 1
        described["buffers"] = [{"byteLength": parts.size}]
        for number, material in enumerate(described.get("materials", [])):
            material["name"] = str(number)  # by which the parser's meshes are matched with their pictures
            _with_base_picture(material)
        return json.dumps(described).encode(), b"".join(parts.data)
    except BadInput:
        raise
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError) as error:
        raise BadInput(f"{path}: its header cannot be read: {error}"[:400], PLAIN) from error


def _start(path: Path, number: int, view: dict[str, Any], starts: list[int]) -> int:
    """Where a view begins in the binary chunk, of buffers that begin at their starts."""
    buffer, offset = view.get("buffer", 0), view.get("byteOffset", 0)
    if not 0 <= buffer < len(starts) or offset < 0:
        raise BadInput(f"{path}: bufferViews.{number}.buffer: it names no place in a buffer", DAMAGED)
    return int(offset) + starts[buffer]


class _Parts:
    """Bytes one behind the other, each beginning at a multiple of four."""

    def __init__(self) -> None:
        self.data, self.size = list[bytes](), 0

    def add(self, data: bytes) -> int:
        """Where these bytes begin."""
        start, padded = self.size, data + b"\0" * (-len(data) % 4)
        self.data.append(padded)
        self.size += len(padded)
        if self.size > MAX_FILE_BYTES:
            raise BadInput(f"the files of the scan hold more than {MAX_FILE_BYTES} bytes", ONE_SHOT)
        return start


def _buffer(path: Path, buffer: dict[str, Any], binary: bytes | None) -> bytes:
    if "uri" not in buffer:
        if binary is None:
            raise BadInput(f"{path} holds no binary chunk, and no buffer in its header", PLAIN)
        return binary
    data = _content(path, uri := buffer["uri"])
    if data is None:
        raise BadInput(f"{path}: its buffer {unquote(uri)[:MAX_NAME]!r} is missing", NEXT_TO_SCAN)
    if len(data) < buffer.get("byteLength", 0):
        raise BadInput(f"{path} seems cut short: a buffer has {len(data)} of {buffer['byteLength']} bytes", DAMAGED)
    return data


def _content(path: Path, uri: str) -> bytes | None:
    """The bytes at an address, None for a file that is not there."""
    if found := _ENCODED.match(uri):
        try:
            return base64.b64decode(uri[found.end() :], validate=True)
        except binascii.Error as error:
            raise BadInput(f"{path}: data in its header are not what they say: {error}", DAMAGED) from error
    if uri.startswith("data:"):
        raise BadInput(f"{path}: a buffer is {uri[:MAX_NAME]!r}", PLAIN)
    file = find_reference(path, unquote(uri))
    return None if file is None else read_bytes(file)


def _with_base_picture(material: dict[str, Any]) -> None:
    """Make a material's only picture its base colour, in place.

    It has a picture for another purpose than its base colour.
    """
    shading = material.setdefault("pbrMetallicRoughness", {})
    specular = material.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness", {})
    other = specular.get("diffuseTexture") or material.get("emissiveTexture")
    if "baseColorTexture" not in shading and other is not None:
        shading["baseColorTexture"] = other
