"""Damaged files of every format: each gives a sound scan or one BadInput that names it, and takes little memory."""

import gzip
import json
import re
import struct
import tracemalloc
import zipfile
import zlib

import numpy as np
import pytest
import trimesh
from PIL import Image

from oracles import clouds
from restore.errors import BadInput
from restore.formats import load_scan, save_scan, write_abs, write_obj, write_ply, write_vrml, write_vvd
from restore.formats.folder import _sha256
from restore.formats.parsing.mesh import texture_uv
from restore.scan import RangeScan
from tests.restore.formats.conftest import as_mesh, make_shot

MUTANTS = 2000  # of each format, from a fixed seed
PART_MUTANTS = 500  # of each file that belongs to a scan
FEW = 0.1  # of them in every run
WATCHED = 40  # of them with their memory measured, which is slow
# The files are of some kilobytes; their parsers' own tables come on top.
PEAK_BYTES = 16 * 2**20

WORDS = (
    b"nan",
    b"-inf",
    b"1e999",
    b"-1",
    b"0",
    b"99999999999999999999",
    b"4294967295",
    b"x",
    b"",
    b"\x00",
    b"1_0",
    b"\xff",
)
INTEGERS = (0, 1, -1, 2**31 - 1, -(2**31), 5, 1000, 2**24)
NUMBER = re.compile(rb"-?\d[\d.]*")


def flip(data, rng):
    out = bytearray(data)
    for at in rng.integers(0, len(data), rng.integers(1, 9)):
        out[at] = rng.integers(0, 256)
    return bytes(out)


def cut(data, rng):
    return data[: rng.integers(0, len(data))]


def remove(data, rng):
    a, b = sorted(rng.integers(0, len(data) + 1, 2))
    return data[:a] + data[b:]


def insert(data, rng):
    at = rng.integers(0, len(data) + 1)
    return data[:at] + rng.bytes(rng.integers(1, 40)) + data[at:]


def repeat(data, rng):
    a, b = sorted(rng.integers(0, len(data) + 1, 2))
    return data[:b] + data[a:]


def swap(data, rng):
    a, b, c = sorted(rng.integers(0, len(data) + 1, 3))
    return data[:a] + data[b:c] + data[a:b] + data[c:]


def reword(data, rng):
    """Replace a number of the text, often of its first lines."""
    found = list(NUMBER.finditer(data))
    if not found:
        return flip(data, rng)
    number = found[int(len(found) * rng.random() ** 3)]
    return data[: number.start()] + WORDS[rng.integers(len(WORDS))] + data[number.end() :]


def recount(data, rng):
    """Overwrite a binary integer, often one of the header."""
    if len(data) < 4:
        return insert(data, rng)
    at = int((len(data) - 3) * rng.random() ** 3)
    value = struct.pack("<i" if rng.random() < 0.5 else ">i", INTEGERS[rng.integers(len(INTEGERS))])
    return data[:at] + value + data[at + 4 :]


MUTATIONS = (flip, cut, remove, insert, repeat, swap, reword, recount)


def mutate(data, rng):
    for _ in range(1 + rng.binomial(2, 0.15)):  # mostly one fault: the rest of the file then leads deep into the parser
        data = MUTATIONS[rng.integers(len(MUTATIONS))](data, rng) or b"\x00"
    return data


def write_mesh(mesh, path):
    picture = trimesh.visual.TextureVisuals(
        texture_uv(mesh.texcoords, mesh.texture), image=Image.fromarray(mesh.texture)
    )
    trimesh.Trimesh(mesh.vertices, mesh.faces, visual=picture, process=False).export(path)


def write_ascii_ply(mesh, path):
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path, encoding="ascii")


def write_ascii_stl(mesh, path):
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path, file_type="stl_ascii")


def write_point_set(scan, path):
    rows, cols, _ = scan.points.shape
    header = f"width: {cols}\nheight: {rows}\ndim: 3\nordered: true\ntype: double\nversion: 1\n<>\n"
    path.write_bytes(header.encode() + scan.points.astype("<f8").tobytes())


# File to damage → how to write a sound one with all that belongs to it.
SOUND = {
    "a.abs": write_abs,
    "a.abs.gz": write_abs,
    "a.wrl": write_vrml,
    "a.vvd": write_vvd,
    "a.obj": lambda scan, path: write_obj(as_mesh(scan), path),
    "binary.ply": lambda scan, path: write_ply(as_mesh(scan), path),
    "text.ply": lambda scan, path: write_ascii_ply(as_mesh(scan), path),
    "binary.stl": lambda scan, path: write_mesh(as_mesh(scan), path),
    "text.stl": lambda scan, path: write_ascii_stl(as_mesh(scan), path),
    "a.vcps": write_point_set,
    "cloud.ply": lambda scan, path: clouds.write_ply(path, scan, remark="comment width 16\ncomment height 12\n"),
    "ascii.pcd": lambda scan, path: clouds.write_pcd(path, scan, "ascii"),
    "binary.pcd": lambda scan, path: clouds.write_pcd(path, scan),
    "compressed.pcd": lambda scan, path: clouds.write_pcd(path, scan, "binary_compressed"),
    "a.npz": lambda scan, path: clouds.write_npz(path, scan),
    "a.npy": lambda scan, path: clouds.write_npy(path, scan),
    "a.glb": lambda scan, path: write_mesh(as_mesh(scan), path),
}
# Files that belong to a scan, and the scan that is loaded with them.
PARTS = {"a.mtl": "a.obj", "a.png": "a.obj", "points.npz": ".", "texture.png": ".", "scan.json": "."}


def write_sound(name, folder):
    """Write the scan that `name` is or belongs to, and return the path to load it by."""
    path = folder / PARTS.get(name, name)
    scan = make_shot(whole=True)
    if path == folder:
        save_scan(scan, folder)
    else:
        SOUND[path.name](scan, path)
    return path


def outcome(path, name):
    """True for a sound scan, False for a declared error that names the file."""
    try:
        scan = load_scan(path)
    except BadInput as error:
        assert name.split(".")[0] in str(error).replace(str(path.parent), "") or name == "scan.json"
        assert error.hint
        return False
    if isinstance(scan, RangeScan):
        rows, cols, _ = scan.points.shape
        assert scan.points.shape[2] == 3
        assert scan.texture_xy.shape == (rows, cols, 2)
        assert np.isfinite(scan.texture_xy).all()
        assert not np.isinf(scan.points).any()
    else:
        assert np.isfinite(scan.vertices).all()
        assert len(scan.faces) > 0
        assert 0 <= scan.faces.min() <= scan.faces.max() < len(scan.vertices)
        assert scan.texcoords is None or np.isfinite(scan.texcoords).all()
    return True


def mutants(path, name, seed, count):
    """Damage the file `name` in many ways, one after the other; every second archive inside, and packed again."""
    rng = np.random.default_rng([seed, *name.encode()])
    target = path.parent / name if path.is_file() else path / name
    sound = target.read_bytes()
    for mutant in range(count):
        if name.endswith(".gz") and mutant % 2:
            damaged = gzip.compress(mutate(gzip.decompress(sound), rng), compresslevel=1)
        elif name == "points.npz" and mutant % 2:
            damaged = repack(target.with_name("again.npz"), sound, rng)
        else:
            damaged = mutate(sound, rng)
        target.write_bytes(damaged)
        if path.is_dir() and name != "scan.json":
            resign(path, name, damaged)
        yield


def repack(place, archive, rng):
    place.write_bytes(archive)
    with zipfile.ZipFile(place) as file:
        members = {name: file.read(name) for name in file.namelist()}
    with zipfile.ZipFile(place, "w") as file:
        for name, data in members.items():
            file.writestr(name, mutate(data, rng))
    return place.read_bytes()


def resign(folder, name, data):
    """Let the checksum agree, so that the damage reaches the parser."""
    index = json.loads((folder / "scan.json").read_text())
    index["files"][name] = _sha256(data)
    (folder / "scan.json").write_text(json.dumps(index))


@pytest.mark.filterwarnings("ignore:Duplicate name")  # zipfile, of names that the mutation made equal
@pytest.mark.parametrize("part", [FEW, pytest.param(1.0, marks=pytest.mark.slow)], ids=["few", "all"])
@pytest.mark.parametrize("name", [*SOUND, *PARTS])
def test_a_damaged_file_gives_a_scan_or_one_declared_error(name, part, tmp_path):
    path = write_sound(name, tmp_path)
    assert outcome(path, name)
    kinds = [sound.split(".")[1] for sound in SOUND]  # text and binary, packed or not
    count = MUTANTS // kinds.count(name.split(".")[1]) if name in SOUND else PART_MUTANTS
    count = int(part * count)
    outcomes = [outcome(path, name) for _ in mutants(path, name, 0, count)]
    assert outcomes.count(False) > 0.02 * count  # the damage is felt
    assert name == "scan.json" or any(outcomes)  # and not every mutant dies at the door


@pytest.mark.parametrize("name", [*SOUND, *PARTS])
def test_a_damaged_file_takes_little_memory(name, tmp_path):
    path = write_sound(name, tmp_path)
    outcome(path, name)
    tracemalloc.start()
    try:
        for _ in mutants(path, name, 1, WATCHED):
            tracemalloc.reset_peak()
            outcome(path, name)
            assert tracemalloc.get_traced_memory()[1] < PEAK_BYTES
    finally:
        tracemalloc.stop()


def deflated(size):
    """A gzip stream of `size` blanks, a thousandth of that long: a block that refers to nothing before it, repeated."""
    stream = zlib.compressobj(9, wbits=31)
    first, block = (stream.compress(b" " * BLOCK) + stream.flush(zlib.Z_FULL_FLUSH) for _ in range(2))
    return first + block * (size // BLOCK - 1)


def png_chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height):
    header = png_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + png_chunk(b"IDAT", zlib.compress(b"\0" * 1000)) + png_chunk(b"IEND", b"")


PLY_HEAD = b"ply\nformat %s 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
PLY_FACES = b"element face 1\nproperty list uint int vertex_indices\nend_header\n"
BLOCK = 10**7  # bytes
BOMBS = {  # made in the test of each: some take a while
    "blanks.abs.gz": lambda: deflated(10**9),
    "samples.abs.gz": lambda: gzip.compress(b"9 rows\n9 columns\npixels (flag X Y Z):\n" + b" " * 10**8, 1),
    "samples.abs": lambda: b"2097152 rows\n1 columns\npixels (flag X Y Z):\n1 2 3",
    "vertices.vvd": lambda: b"VIVID".ljust(132, b"\0") + struct.pack(">i", 2**31 - 1) + b"\0" * 999,
    "faces.vvd": lambda: b"VIVID".ljust(132, b"\0") + struct.pack(">i3di", 1, 0, 0, -1, 2**30) + b"\0" * 999,
    "vertices.ply": lambda: PLY_HEAD % (b"ascii", 10**9) + PLY_FACES + b"0 0 0\n",
    "list.ply": lambda: PLY_HEAD % (b"binary_little_endian", 1) + PLY_FACES + b"\0" * 12 + b"\xff" * 40,
    "triangles.stl": lambda: b"\0" * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 50,
    "lines.obj": lambda: b"v\n" * 9_000_000,
    "brackets.wrl": lambda: b"#VRML V1.0 ascii\n" + b"Coordinate3 { point [" * 10**5,
    "picture.png": lambda: png(30_000, 30_000),
}
BOMB_PEAK_BYTES = 64 * 2**20  # the largest of the files has 18 MB; unpacked or believed, each would take a gigabyte


@pytest.mark.parametrize("name", BOMBS)
def test_a_file_that_promises_too_much_is_refused_before_the_memory_is_taken(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(BOMBS[name]())
    if name == "picture.png":
        path = tmp_path / "picture.abs"
        write_abs(make_shot(whole=True), path)
    load_sound_once(tmp_path)
    tracemalloc.start()
    try:
        with pytest.raises(BadInput, match=path.stem):
            load_scan(path)
        assert tracemalloc.get_traced_memory()[1] < BOMB_PEAK_BYTES
    finally:
        tracemalloc.stop()


def load_sound_once(folder):
    """Import what is imported late, so that the measure holds the file alone."""
    write_ply(as_mesh(make_shot()), folder / "sound.ply")
    load_scan(folder / "sound.ply")
