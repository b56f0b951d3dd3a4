"""A page written to a file, in the formats and spellings of other programs."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np
from PIL import Image

from bench.foreign.dialects import DIALECTS
from bench.foreign.page import Case, Part


def write_obj(case: Case, folder: Path, rng: Random) -> Path:
    """Write a Wavefront file with a drawn number of decimals, in groups or not."""
    decimals, lines, start = rng.randint(4, 7), ["mtllib page.mtl"], 1
    materials = []
    for k, part in enumerate(case.parts):
        lines += [f"g part{k}"] if rng.random() < 0.5 else []
        lines += [f"v {x:.{decimals}f} {y:.{decimals}f} {z:.{decimals}f}" for x, y, z in part.vertices]
        lines += [f"vt {u:.6f} {v:.6f}" for u, v in part.uv]
        lines += [f"usemtl {part.picture}"]
        lines += ["f " + " ".join(f"{c}/{c}" for c in face) for face in part.faces + start]
        start += len(part.vertices)
    for name, picture in case.pictures.items():
        materials += [f"newmtl {name}", f"map_Kd {name}.png"]
        Image.fromarray(picture).save(folder / f"{name}.png")
    (folder / "page.mtl").write_text("\n".join(materials) + "\n")
    path = folder / "scan.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


def write_ply(case: Case, folder: Path, rng: Random) -> Path:
    """Write a polygon file in single precision with coordinates of vertices, as binary of either order or text."""
    part, order = _one(case), rng.choice(["little", "big", "text"])
    form = {"little": "binary_little_endian", "big": "binary_big_endian", "text": "ascii"}[order]
    names = rng.choice([("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
    header = f"ply\nformat {form} 1.0\ncomment TextureFile page.png\nelement vertex {len(part.vertices)}\n"
    header += "".join(f"property float {name}\n" for name in ("x", "y", "z", *names))
    header += f"element face {len(part.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = np.hstack([part.vertices, part.uv])
    path = folder / "scan.ply"
    if order == "text":
        body = [" ".join(f"{value:.6g}" for value in row) for row in rows]
        body += [f"3 {a} {b} {c}" for a, b, c in part.faces]
        path.write_text(header + "\n".join(body) + "\n")
    else:
        mark = "<" if order == "little" else ">"
        faces = np.zeros(len(part.faces), [("n", "u1"), ("i", f"{mark}i4", 3)])
        faces["n"], faces["i"] = 3, part.faces
        path.write_bytes(header.encode() + rows.astype(f"{mark}f4").tobytes() + faces.tobytes())
    Image.fromarray(case.pictures["page"]).save(folder / "page.png")
    return path


def write_glb(case: Case, folder: Path, rng: Random) -> Path:
    """Write binary glTF in metres by trimesh, each part a mesh of its own or all in one."""
    import trimesh

    scene = trimesh.Scene()
    for k, part in enumerate(case.parts if rng.random() < 0.5 else [_one(case)]):
        material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(case.pictures[part.picture]))
        visual = trimesh.visual.TextureVisuals(uv=part.uv, material=material)
        mesh = trimesh.Trimesh(part.vertices / 1000.0, part.faces, visual=visual, process=False)
        scene.add_geometry(mesh, node_name=f"part{k}", geom_name=f"part{k}")
    path = folder / "scan.glb"
    path.write_bytes(scene.export(file_type="glb"))
    return path


def write_tifxyz(case: Case, folder: Path, rng: Random) -> Path:
    """Write a segment in voxels of 10 µm, with the lines doubled that the case notes, and a scale that is wrong."""
    part = case.parts[0]
    rows = len(np.unique(part.uv[:, 1]))
    points = part.vertices.reshape(rows, -1, 3)[::-1] * 100.0 + [1000.0, 1000.0, 20000.0]  # its rows run down
    points = np.moveaxis(points, case.notes["axis"], 0)
    for line in sorted(rng.sample(range(4, len(points) - 4, 4), case.notes["lines"]), reverse=True):
        if case.notes["besides"]:
            points = np.insert(points, line, points[line], axis=0)
        else:
            points[line] = points[line - 1]
    points = np.moveaxis(points, 0, case.notes["axis"])
    for axis, name in enumerate("xyz"):
        Image.fromarray(points[..., axis].astype(np.float32)).save(folder / f"{name}.tif")
    scale = 0.05 / rng.choice([1.0, 173.0])
    (folder / "meta.json").write_text(json.dumps({"format": "tifxyz", "scale": [scale, scale]}))
    return folder


def _one(case: Case) -> Part:
    from bench.foreign.families import _together

    return case.parts[0] if len(case.parts) == 1 else _together(case.parts)


WRITERS: dict[str, Callable[[Case, Path, Random], Path]] = {"obj": write_obj, "ply": write_ply, "glb": write_glb}
"""Formats that are drawn."""


def write(case: Case, folder: Path, rng: Random) -> tuple[str, Path]:
    """Write a case in the format that its family needs or that is drawn, in a dialect if it is of that family."""
    if "writer" in case.notes:
        return case.notes["writer"], write_tifxyz(case, folder, rng)
    kind = rng.choice(list(WRITERS))
    path = WRITERS[kind](case, folder, rng)
    if not case.notes.get("dialect"):
        return kind, path
    name = rng.choice(list(DIALECTS[kind]))
    return f"{kind}, {name}", DIALECTS[kind][name](path, rng)
