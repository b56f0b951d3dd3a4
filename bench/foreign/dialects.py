"""One file spelt as other programs spell it: each function rewrites a file that was written plainly."""

from __future__ import annotations

import json
import re
import struct
import unicodedata
from collections.abc import Callable, Mapping
from pathlib import Path
from random import Random
from typing import Any

Dialect = Callable[[Path, Random], Path]


def _obj(lines: Callable[[str], str] = str, material: Callable[[str], str] = str, picture: str = "page.png") -> Dialect:
    """An OBJ file with its text, that of its material file, and the name of its picture changed."""

    def rewritten(path: Path, _rng: Random) -> Path:
        folder = path.parent
        path.write_text(lines(path.read_text()), newline="")
        (folder / "page.mtl").write_text(material((folder / "page.mtl").read_text()), newline="")
        (folder / "page.png").rename(folder / picture)
        return path

    return rewritten


def _each(kind: str, change: Callable[[str], str]) -> Callable[[str], str]:
    """The text with its lines of a kind changed."""
    return lambda text: "\n".join(change(line) if line.startswith(kind) else line for line in text.split("\n"))


def _from_the_end(text: str) -> str:
    """Faces that count vertices backwards."""
    count = text.count("\nv ")
    return _each("f ", lambda line: re.sub(r"\d+", lambda number: str(int(number[0]) - 1 - count), line))(text)


def _without_material_file(path: Path, _rng: Random) -> Path:
    (path.parent / "page.mtl").unlink()
    (path.parent / "page.png").rename(path.with_suffix(".png"))
    return path


OBJ: Mapping[str, Dialect] = {
    "lines end with returns": _obj(lambda text: text.replace("\n", "\r\n"), lambda text: text.replace("\n", "\r\n")),
    "normals": _obj(_each("f ", lambda line: re.sub(r"(\d+)/(\d+)", r"\1/\2/1", line))),
    "decimal commas": _obj(_each("v", lambda line: line.replace(".", ","))),
    "no usemtl": _obj(lambda text: text.replace("usemtl page\n", "")),
    "other material": _obj(lambda text: text.replace("usemtl page\n", "usemtl Material.001\n")),
    "two libraries": _obj(lambda text: text.replace("mtllib page.mtl", "mtllib gone.mtl page.mtl")),
    "foreign path": _obj(material=lambda text: text.replace("page.png", "C:\\Users\\me\\page.png")),
    "other case": _obj(material=lambda text: text.replace("page.png", "Page.PNG")),
    "composed name": _obj(
        material=lambda text: text.replace("page.png", "Söte.png"), picture=unicodedata.normalize("NFD", "Söte.png")
    ),
    "options of the map": _obj(material=lambda text: text.replace("map_Kd ", "map_Kd -clamp on -s 1 1 1 ")),
    "ambient map": _obj(material=lambda text: text.replace("map_Kd", "Kd 0 0 0\nmap_Ka")),
    "quotes": _obj(material=lambda text: text.replace("page.png", '"page.png"')),
    "counted from the end": _obj(_from_the_end),
    "no material file": _without_material_file,
    "vertices of no face": _obj(lambda text: text + "v nan nan nan\nv nan 0 0\n"),
}


def _this(path: Path, _rng: Random) -> Path:
    path.write_bytes(path.read_bytes().replace(b"TextureFile page.png", b"TextureFile <this>.png"))
    (path.parent / "page.png").rename(path.with_suffix(".png"))
    return path


PLY: Mapping[str, Dialect] = {
    "this": _this,
    "more comments": lambda path, _rng: _header(path, lambda text: text.replace(b"comment", b"comment x\ncomment")),
}


def _header(path: Path, change: Callable[[bytes], bytes]) -> Path:
    head, mark, body = path.read_bytes().partition(b"end_header\n")
    path.write_bytes(change(head) + mark + body)
    return path


def _glb(change: Callable[[dict[str, Any]], None], *, separate: bool = False) -> Dialect:
    """A binary glTF file with its header changed, or as glTF with its buffer in a file."""

    def rewritten(path: Path, _rng: Random) -> Path:
        data = path.read_bytes()
        size = struct.unpack_from("<I", data, 12)[0]
        header, chunk = json.loads(data[20 : 20 + size]), data[20 + size + 8 :]
        change(header)
        if separate:
            header["buffers"] = [{"byteLength": len(chunk), "uri": "page%20data.bin"}]
            (path.parent / "page data.bin").write_bytes(chunk)
            path.with_suffix(".gltf").write_text(json.dumps(header))
            return path.with_suffix(".gltf")
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 4)
        body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(chunk), b"BIN\0") + chunk
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
        return path

    return rewritten


def _emissive(header: dict[str, Any]) -> None:
    for material in header["materials"]:
        material["emissiveTexture"] = material["pbrMetallicRoughness"].pop("baseColorTexture")


def _specular(header: dict[str, Any]) -> None:
    for material in header["materials"]:
        texture = material["pbrMetallicRoughness"].pop("baseColorTexture")
        material["extensions"] = {"KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": texture}}
    header["extensionsUsed"] = ["KHR_materials_pbrSpecularGlossiness"]


def _turned_root(header: dict[str, Any]) -> None:
    header["nodes"].append({"children": header["scenes"][0]["nodes"], "rotation": [0.0, 0.6, 0.0, 0.8]})
    header["scenes"][0]["nodes"] = [len(header["nodes"]) - 1]


GLB: Mapping[str, Dialect] = {
    "separate files": _glb(lambda _header: None, separate=True),
    "emissive": _glb(_emissive),
    "specular-glossiness": _glb(_specular),
    "turned root": _glb(_turned_root),
}

DIALECTS: Mapping[str, Mapping[str, Dialect]] = {"obj": OBJ, "ply": PLY, "glb": GLB}
