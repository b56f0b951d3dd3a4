"""`.obj`: Wavefront text with its material file and picture.

v points up in the picture.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path, PurePosixPath

import numpy as np

from restore.errors import BadInput
from restore.findings import NOTABLE, Finding
from restore.formats.cleaning.bare_faces import kept_faces
from restore.formats.cleaning.packing import pack
from restore.formats.obj_text import ObjText, parse_obj
from restore.formats.parsing.mesh import PaintedMesh, checked_mesh, fan_triangles, split_seams, texture_uv
from restore.formats.parsing.picture import adjacent_picture, encode_png, read_image
from restore.formats.parsing.source import (
    CUT_SHORT,
    MISSING,
    ONE_SHOT,
    find_reference,
    read_bytes,
    with_newlines,
    without_mark,
)
from restore.numerics.robust import MAJORITY
from restore.scan import Bytes, Ints, Mask, SurfaceMesh

MAX_MATERIAL_BYTES = 2**20  # a material file is a page of text
MAX_LIBRARIES = 16  # a scan has one
LARGE_MESH = 1000  # vertices: more than in files written by hand
UNMOVED = {b"-s": 1.0, b"-o": 0.0}  # scale and offset that leave the texture coordinates as they are
MAPS = (b"map_kd", b"map_ka", b"map_ke")
_COMMAS = re.compile(rb"^[ \t]*v[ \t]+[-+]?\d*,\d", re.MULTILINE)
_NUMBERS = re.compile(rb"^[ \t]*v[tn]?[ \t].*$", re.MULTILINE)
_FACES_AND_MATERIALS = re.compile(rb"^[ \t]*(?:f[ \t]|usemtl[ \t]+([^\n]*))", re.MULTILINE)
_NUMBER = re.compile(rb"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def read_obj(path: Path, texture: Bytes | None = None) -> PaintedMesh:
    """Read a mesh with texture coordinates.

    texture: (h, w, 3), replaces the picture of its material.
    Raises BadInput.
    """
    data, commas = _with_points(with_newlines(without_mark(read_bytes(path))))
    text = parse_obj(path, data)
    starts = np.cumsum(text.sizes) - text.sizes
    faces, uv_faces = fan_triangles(text.corners, starts, text.sizes), fan_triangles(text.uvs, starts, text.sizes)
    unused = _check_complete(path, data, text, faces)
    colours, doubts = _colours(text)
    bare: Mask = np.any(uv_faces < 0, axis=1)
    pictures, of_faces, notes = list[Bytes](), np.zeros(len(faces), np.int64), list[Finding]()
    if not bare.all() and texture is None:
        pictures, of_faces, notes = _pictures(path, data, text)
        if not pictures and colours is None and (adjacent := adjacent_picture(path)) is not None:
            pictures = [adjacent]
    elif texture is not None:
        pictures = [texture]
    kept, findings = kept_faces(bare, pictured=bool(pictures))
    texture = pictures[0] if pictures else None
    findings = (*commas, *unused, *(doubts if texture is None else ()), *notes, *findings)
    if bare[kept].any():
        return checked_mesh(path, text.vertices, faces, texture=texture, colours=colours, findings=findings)
    uv_count = len(text.uv)
    take, take_uv, faces = split_seams(
        faces[kept], uv_faces[kept] + of_faces[kept, None] * uv_count, uv_count * max(len(pictures), 1)
    )
    uv = text.uv[take_uv % uv_count]
    if len(pictures) > 1:
        texture, uv = pack(path, pictures, uv, take_uv // uv_count, faces)
        findings = (*findings, Finding.of("pictures_packed", count=len(pictures)))
    return checked_mesh(
        path,
        text.vertices[take],
        faces,
        uv=uv,
        texture=texture,
        colours=None if colours is None or texture is not None else colours[take],
        findings=findings,
    )


def write_obj(mesh: SurfaceMesh, path: Path) -> None:
    """Write a mesh with 0.1 µm of resolution.

    When it has a texture, its .mtl and .png are written next to it.
    """
    lines = [f"mtllib {path.stem}.mtl", "usemtl page"] if mesh.texcoords is not None else []
    lines += map("v {:.4f} {:.4f} {:.4f}".format, *mesh.vertices.T)
    corner = "{0}"
    if mesh.texture is not None and mesh.texcoords is not None:
        lines += map("vt {:.7f} {:.7f}".format, *texture_uv(mesh.texcoords, mesh.texture).T)
        corner = "{0}/{0}"
        path.with_suffix(".mtl").write_text(f"newmtl page\nKd 1 1 1\nmap_Kd {path.stem}.png\n", encoding="utf-8")
        path.with_suffix(".png").write_bytes(encode_png(mesh.texture))
    face = "f " + " ".join(corner.replace("0", str(k)) for k in range(3))
    lines += map(face.format, *(mesh.faces + 1).T.tolist())
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _check_complete(path: Path, data: bytes, text: ObjText, faces: Ints) -> tuple[Finding, ...]:
    """Return a finding where the last vertices are in no face.

    The file may be cut short between two lines. Scanners write as many vertices as their faces use, before the faces;
    editors leave the vertices of faces that were deleted. Raises BadInput when the last face is not complete, or
    vertices are unused and the last line has no end, or most are unused.
    """
    if len(faces) == 0:
        return ()
    last = data[data.rfind(b"\n") + 1 :].split()
    if last[:1] == [b"f"] and len(last) < 4:
        raise BadInput(f"{path} seems cut short: its last face is not complete", CUT_SHORT)
    used = (int(faces.max()) + 1) / len(text.vertices)
    large, ended = len(text.vertices) >= LARGE_MESH, data.endswith(b"\n")
    # Where the faces use fewer though the last line has an end, more were lost than an editor deletes.
    if used < (MAJORITY if large and ended else 0.0 if ended else 1.0):
        raise BadInput(f"{path} seems cut short: its faces use the first {used:.0%} of its vertices", CUT_SHORT)
    if large and used < 1.0 - NOTABLE:
        return (Finding.of("unused_vertices", used),)
    return ()


def _colours(text: ObjText) -> tuple[Bytes | None, tuple[Finding, ...]]:
    """Return the colours of vertices, and a finding where they are ambiguous.

    The colours are (n, 3): all vertices have one, 0 to 1 or 0 to 255 in the file. Four numbers behind the position are
    r g b and opacity, or w of homogeneous coordinates, which is 1, and r g b.
    """
    others = text.others
    if not len(others) or np.isnan(others[:, :3]).any():
        return None, ()
    four = not np.isnan(others[:, 3]).any()
    behind = four and bool((others[:, 0] == 1.0).all())
    if behind and bool((others[:, 3] == others[0, 3]).all()) and bool((others != others[0]).any()):
        return None, (Finding.of("colours_ambiguous"),)
    colours = others[:, 1:] if behind else others[:, :3]
    scale = 255.0 if colours.max() <= 1.0 else 1.0
    return np.clip(np.rint(scale * colours), 0, 255).astype(np.uint8), ()


def _with_points(data: bytes) -> tuple[bytes, tuple[Finding, ...]]:
    """The text with decimal points where its numbers have commas, and a finding then."""
    if not _COMMAS.search(data):
        return data, ()
    return _NUMBERS.sub(lambda line: line[0].replace(b",", b"."), data), (Finding.of("decimal_commas"),)


def _pictures(path: Path, data: bytes, text: ObjText) -> tuple[list[Bytes], Ints, list[Finding]]:
    """Return the pictures of the materials that faces use, None when no material names one.

    Returns also which of them each triangle (m,) has, and findings.
    """
    if len(text.libraries) > MAX_LIBRARIES:
        raise BadInput(f"{path} uses {len(text.libraries)} material files, a scan has one", ONE_SHOT)
    named: dict[bytes, tuple[bytes, str]] = {}
    found, one = list[Finding](), np.zeros(int(np.maximum(text.sizes - 2, 0).sum()), np.int64)
    for library in text.libraries:
        for name in _library_names(path, file_name(library)):
            file = find_reference(path, name)
            if file is None:
                found.append(Finding.of("material_missing", name=repr(name)))
            else:
                named |= _materials(file, name)
    used = set(text.materials)
    values = {material: value for material, value in named.items() if material in used or not used}
    if used and not values and len(set(named.values())) == 1:
        values = dict.fromkeys(used, next(iter(named.values())))
        found.append(Finding.of("material_lacking"))
    for value, _ in values.values():
        _check_options(path, value)
    files = {material: _picture_file(path, picture_name(value), folder) for material, (value, folder) in values.items()}
    distinct = sorted(set(files.values()))
    pictures = [read_image(file) for file in distinct]
    if len(pictures) < 2:
        return pictures, one, found
    if not used:
        raise BadInput(f"{path} has {len(pictures)} images, and no face names one", ONE_SHOT)
    of_polygons = _picture_of_polygons(data, {name: distinct.index(file) for name, file in files.items()})
    return pictures, np.repeat(of_polygons, np.maximum(text.sizes - 2, 0)), found


def _picture_of_polygons(data: bytes, pictures: dict[bytes, int]) -> Ints:
    """Return the number (p,) of the picture of each face line, 0 before any material."""
    current, found = 0, []
    for line in _FACES_AND_MATERIALS.finditer(data):
        if line[1] is None:
            found.append(current)
        else:
            current = pictures.get(line[1].strip(), current)
    return np.array(found, np.int64)


def _library_names(path: Path, name: str) -> list[str]:
    """The material files that a line names: one, whose name may have blanks, or several."""
    several = name.split()
    if len(several) < 2 or find_reference(path, name) is not None:
        return [name]
    return several if any(find_reference(path, one) is not None for one in several) else [name]


def _materials(file: Path, name: str) -> dict[bytes, tuple[bytes, str]]:
    """Return options, picture and folder of each material that has a picture.

    The picture of the diffuse colour goes before that of the ambient, and that before the emissive one.
    """
    found: dict[bytes, dict[bytes, bytes]] = {}
    material = b""
    for key, value in _settings(read_bytes(file, MAX_MATERIAL_BYTES)):
        if key == b"newmtl":
            material = value
        elif key in MAPS:
            found.setdefault(material, {})[key] = value
    folder = str(PurePosixPath(name.replace("\\", "/")).parent)
    return {of: (maps[next(key for key in MAPS if key in maps)], folder) for of, maps in found.items()}


def _settings(text: bytes) -> Iterator[tuple[bytes, bytes]]:
    """The lines of a material file, each as its first word in lower case and the rest."""
    for line in with_newlines(without_mark(text)).split(b"\n"):
        key, _, value = line.strip().replace(b"\t", b" ").partition(b" ")
        yield key.lower(), value.strip()


def _check_options(path: Path, value: bytes) -> None:
    """Raise BadInput for options that scale or move the coordinates.

    They come before the name of a picture.
    """
    words = value.split()
    for option, neutral in UNMOVED.items():
        behind = words[words.index(option) + 1 :] if option in words else []
        numbers = [float(word) for word in takewhile(_NUMBER.fullmatch, behind[:2])]  # the third is for depth
        if any(number != neutral for number in numbers):
            text = b" ".join([option, *behind[:2]]).decode("latin-1")
            raise BadInput(f"{path}: the option {text} moves its image", "apply it to the coordinates in an editor")


def file_name(value: bytes) -> str:
    """Return the name of a file, which may be quoted.

    It is Latin-1 where it is not UTF-8.
    """
    try:
        name = value.decode("utf-8")
    except UnicodeDecodeError:
        name = value.decode("latin-1")
    return name[1:-1] if len(name) > 1 and name[0] == name[-1] == '"' else name


def picture_name(value: bytes) -> str:
    """The name behind options like "-s 1 1 1" and "-clamp on", which may stand before it."""
    words = value.split(b" ")
    at = 0
    while at < len(words) and words[at].startswith(b"-") and words[at][1:].isalpha():
        at += 1
        while at < len(words) - 1 and _is_argument(words[at]):
            at += 1
    return file_name(b" ".join(words[at:]))


def _is_argument(word: bytes) -> bool:
    return word in (b"", b"on", b"off") or not word.strip(b"-+.0123456789eE")


def _picture_file(path: Path, name: str, folder: str) -> Path:
    """Return the file of a picture's name, next to the mesh or to the material file."""
    places = (find_reference(path, place) for place in (name, f"{folder}/{name}"))
    file = next((place for place in places if place is not None), None)
    if file is None:
        raise BadInput(f"{path}: its image {name!r} is missing", MISSING)
    return file.resolve()
