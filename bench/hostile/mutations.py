"""Mutations that know the structure of a file: its numbers, counts, indices, lines, brackets, chunks, encodings."""

from __future__ import annotations

import gzip
import io
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from random import Random
from typing import Any

Mutation = Callable[[bytes, Random], bytes]

GROWN_BYTES = 24 * 2**20  # of a file that a mutation makes large, at most; a fifth of that on average
GROWN_FRACTION = 0.01  # of the files: large ones take a hundred times as long
SECOND_FRACTION = 0.2  # of the files have two faults: mostly one, as the rest then leads deep into the reader
WORDS = [
    b"", b"0", b"-1", b"1", b"2", b"255", b"256", b"65536", b"2147483647", b"-2147483648", b"4294967295",
    b"99999999999999999999", b"1e999", b"-1e-999", b"1e5", b"nan", b"-inf", b"0x10", b"1_0", b"1,5", b"1.2.3", b"+-1",
    b"x", b"\x00", b"\xff\xfe", "½".encode(), b"1" * 400, b"0." + b"3" * 400, b"../../../etc/passwd", b"/dev/zero",
]  # fmt: skip
INTEGERS = (0, 1, 2, 3, 5, -1, -2, 127, 128, 255, 256, 1000, 65535, 65536, 2**24, 2**31 - 1, -(2**31), 2**32 - 1)
VALUES: list[Any] = [
    None, True, [], {}, "", "x", 0, -1, 1, 0.5, 2**31, 2**63, 2**70, -(2**70), 1e308, -1e308, "9" * 300, ["a"], [[]],
    {"a": 1}, "\ud800", "../x", [1, 2, 3], [0] * 1000, "a.bin",
]  # fmt: skip
BRACKETS = ((b"[", b"]"), (b"{", b"}"), (b"(", b")"), (b'"', b'"'), (b"{a=", b"}"), (b'{"a":', b"}"), (b"a.", b"a=1"))
_NUMBER = re.compile(rb"-?\d[\d.]*")
_WORD = re.compile(rb"[A-Za-z_]\w+")


def mutate(data: bytes, kind: str, rng: Random) -> bytes:
    """The file with one fault or two, by the mutations of its kind: a key of KINDS."""
    for _ in range(1 + (rng.random() < SECOND_FRACTION)):
        data = rng.choice(KINDS[kind])(data, rng) or b"\0"
    if rng.random() < GROWN_FRACTION:
        data = _grown(data, rng)
    return data


def _number(data: bytes, rng: Random) -> bytes:
    """Replace a number by a word, or move it by one; often one of the first, which are counts."""
    found = list(_NUMBER.finditer(data))
    if not found:
        return _flip(data, rng)
    number = found[int(len(found) * rng.random() ** rng.choice((1, 3)))]
    word = rng.choice(WORDS)
    if rng.random() < 0.3 and number[0].isdigit():
        word = str(rng.choice((int(number[0]) + rng.choice((-1, 1)), int(number[0]) * 2, int(number[0]) // 2))).encode()
    return data[: number.start()] + word + data[number.end() :]


def _keyword(data: bytes, rng: Random) -> bytes:
    """Replace a word by another of the file, or remove it."""
    found = list(_WORD.finditer(data))
    if not found:
        return _flip(data, rng)
    place, other = found[int(len(found) * rng.random() ** 2)], rng.choice(found)[0]
    return data[: place.start()] + rng.choice((other, b"")) + data[place.end() :]


def _lines(data: bytes, rng: Random) -> bytes:
    """Remove, repeat or move a line, or join it with the next."""
    lines = data.split(b"\n")
    at = int(len(lines) * rng.random() ** 2)
    match rng.randrange(4):
        case 0:
            del lines[at]
        case 1:
            lines.insert(rng.randrange(len(lines)), lines[at])
        case 2:
            lines.insert(rng.randrange(len(lines)), lines.pop(at))
        case _:
            lines[at : at + 2] = [b" ".join(lines[at : at + 2])]
    return b"\n".join(lines)


def _nested(data: bytes, rng: Random) -> bytes:
    """Put a value, or the end of a line, into many brackets, closed or not."""
    depth = rng.choice((1, 10, 999, 5000, 100_000))
    opening, closing = rng.choice(BRACKETS)
    found = list(_NUMBER.finditer(data))
    at = rng.choice(found).start() if found else 0
    between = rng.choice((b"", b"\n" if depth < 10_000 else b""))
    inner = (opening + between) * depth + b"1" + rng.choice((closing * depth, b""))
    return data[:at] + inner + data[at:]


def _encoding(data: bytes, rng: Random) -> bytes:
    """Encode the text in another way, or end its lines in another."""
    text = data.decode("latin-1")
    match rng.randrange(7):
        case 0:
            return b"\xef\xbb\xbf" + data
        case 1:
            return text.encode("utf-16")
        case 2:
            return text.encode("utf-32-be")
        case 3:
            return data.replace(b"\n", b"\r\n")
        case 4:
            return data.replace(b"\n", b"\r")
        case 5:
            return data.replace(b" ", rng.choice((b"\t", b"  ", b"\xa0", b"\x0b", b"\x00")))
        case _:
            return data.upper()


def _flip(data: bytes, rng: Random) -> bytes:
    out = bytearray(data)
    for _ in range(rng.randrange(1, 9)):
        out[int(len(out) * rng.random() ** rng.choice((1, 4)))] = rng.randrange(256)
    return bytes(out)


def _integer(data: bytes, rng: Random) -> bytes:
    """Overwrite a binary integer, often one of the header."""
    form = rng.choice("<>") + rng.choice("Iii HQ".replace(" ", ""))
    value = rng.choice(INTEGERS) & (256 ** struct.calcsize(form) - 1)
    word = value.to_bytes(struct.calcsize(form), "little" if form[0] == "<" else "big")
    at = int(max(len(data) - len(word), 0) * rng.random() ** rng.choice((1, 4)))
    return data[:at] + word + data[at + len(word) :]


def _cut(data: bytes, rng: Random) -> bytes:
    return data[: rng.randrange(len(data))]


def _remove(data: bytes, rng: Random) -> bytes:
    a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:a] + data[b:]


def _repeat(data: bytes, rng: Random) -> bytes:
    a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:b] + data[a:]


def _insert(data: bytes, rng: Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.randbytes(rng.randrange(1, 40)) + data[at:]


def _grown(data: bytes, rng: Random) -> bytes:
    """Repeat a line, a word or a piece of the file, or a byte, until the file is large."""
    a = rng.randrange(len(data))
    start, end = data.rfind(b"\n", 0, a) + 1, data.find(b"\n", a) + 1
    word = rng.choice(_WORD.findall(data[:4096]) or [b"x"])
    pieces = (data[start:end], word + b" ", data[a : a + rng.randrange(1, 200)], rng.choice((b" ", b"\n", b"[", b"0 ")))
    piece, at = rng.choice(pieces) or b"\n", rng.choice((start, a, len(data)))
    return data[:at] + piece * int(GROWN_BYTES * rng.random() ** 4 / len(piece)) + data[at:]


def _tree(data: bytes, rng: Random) -> bytes:
    """Replace, remove or repeat one value of a JSON text, or put it into a list many times over."""
    try:
        places = list(_places(tree := json.loads(data)))
    except (ValueError, RecursionError):
        return _number(data, rng)
    if not places:
        return _number(data, rng)
    owner, key = rng.choice(places)
    match rng.randrange(6):
        case 0:
            del owner[key]
        case 1 if isinstance(owner, list):
            owner.extend([owner[key]] * rng.choice((1, 100, 3000)))
        case 2:
            other, there = rng.choice(places)
            owner[key] = json.loads(json.dumps(other[there])) if there in other or isinstance(other, list) else None
        case _:
            owner[key] = rng.choice(VALUES)
    return json.dumps(tree).encode("utf-8", "surrogatepass")


def _places(tree: Any) -> Any:
    """Every (container, key) of a JSON value."""
    for key in list(tree) if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ():
        yield tree, key
        yield from _places(tree[key])


def _inside_gzip(data: bytes, rng: Random) -> bytes:
    try:
        return gzip.compress(mutate(gzip.decompress(data), "text", rng), compresslevel=1)
    except (OSError, EOFError, zlib.error):
        return _flip(data, rng)


def _inside_zip(data: bytes, rng: Random) -> bytes:
    """Mutate one array of an archive of arrays, often in its header, and pack it again."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except (OSError, ValueError, RuntimeError, NotImplementedError, EOFError, zipfile.BadZipFile, zlib.error):
        return _flip(data, rng)
    out, chosen = io.BytesIO(), rng.choice(list(members))
    head = members[chosen][:128]
    body = members[chosen][128:]
    members[chosen] = mutate(head, "text", rng) + body if rng.random() < 0.7 else head + mutate(body, "binary", rng)
    with zipfile.ZipFile(out, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return out.getvalue()


def _inside_glb(data: bytes, rng: Random) -> bytes:
    """Mutate the header of a binary glTF file, and correct the lengths of its chunks."""
    if len(data) < 20:
        return _flip(data, rng)
    length = min(struct.unpack_from("<I", data, 12)[0], len(data) - 20)
    header, rest = rng.choice((_tree, _tree, _tree, _number, _nested))(data[20 : 20 + length], rng), data[20 + length :]
    header += b" " * (-len(header) % 4)
    return (
        struct.pack("<4sII", b"glTF", 2, 20 + len(header) + len(rest))
        + struct.pack("<I4s", len(header), b"JSON")
        + header
        + rest
    )


def _inside_png(data: bytes, rng: Random) -> bytes:
    """Mutate one chunk of a PNG file, remove it or repeat it, and correct its length and its checksum."""
    chunks, at = list[tuple[bytes, bytes]](), 8
    while at + 12 <= len(data):
        length = struct.unpack_from(">I", data, at)[0]
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    if not chunks:
        return _flip(data, rng)
    chosen = rng.randrange(len(chunks))
    kind, body = chunks[chosen]
    match rng.randrange(4):
        case 0:
            del chunks[chosen]
        case 1:
            chunks.insert(chosen, (rng.choice((kind, b"iTXt", b"zTXt", b"PLTE", b"tRNS", b"eXIf")), body))
        case _:
            chunks[chosen] = kind, rng.choice((_integer, _flip, _cut, _repeat))(body or b"\0", rng)
    parts = (
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in chunks
    )
    return data[:8] + b"".join(parts)


_ANY = (_cut, _remove, _repeat, _insert, _flip)
_TEXT = (_number, _number, _number, _keyword, _lines, _lines, _nested, _encoding, *_ANY)
KINDS: dict[str, tuple[Mutation, ...]] = {
    "text": _TEXT,
    "binary": (_integer, _integer, _integer, _flip, *_ANY),
    "mixed": (_number, _keyword, _lines, _integer, _integer, _integer, *_ANY),
    "json": (_tree, _tree, _tree, _tree, *_TEXT),
    "gzip": (_inside_gzip, _inside_gzip, _inside_gzip, *_ANY),
    "zip": (_inside_zip, _inside_zip, _inside_zip, _integer, *_ANY),
    "glb": (_inside_glb, _inside_glb, _inside_glb, _inside_glb, _integer, *_ANY),
    "png": (_inside_png, _inside_png, _inside_png, _integer, *_ANY),
}
