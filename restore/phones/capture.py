"""A page out of a phone's capture.

It is cut out of its mesh, to be textured from its photographs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np

from restore.camera.photo_camera import PhotoCamera
from restore.errors import BadInput, NotEnoughSurface
from restore.findings import Finding
from restore.mesh.clean import large_pieces, select, weld
from restore.mesh.measures import surface_area, vertex_normals
from restore.mesh.validate import validated
from restore.phones import polycam, scanner_app
from restore.phones.arkit import Frame
from restore.phones.detect import is_polycam
from restore.photo import Photograph, read_photograph
from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.page import CardInView, PaperMasks, find_paper
from restore.scan import Mask, SurfaceMesh

MAX_FRAMES = 12  # that are read: as many as of a video
FINE_MM = 2.5  # edges of the mesh where the page is cut out of it; a phone's own are 10 to 20 mm
MAX_SUBDIVISIONS = 7  # from edges of 300 mm
MAX_FACES = 2_000_000  # then: FINE_MM apart on five square metres, more than any page
MAX_VIEWS = (
    0.75  # show paper at a place of the page; of those of the mesh that hangs from its edge to the table, half do
)
MIN_AREA_MM2 = 2500.0  # half of a business card
HINT = "scan the page alone, on a table that is darker than paper, and export the capture with all its images"


class Reader(Protocol):
    """A module that reads one program's export."""

    def read_mesh(self, folder: Path) -> SurfaceMesh:
        """The mesh in the frame of the cameras, mm, z up."""
        ...

    def read_frames(self, folder: Path) -> tuple[list[Frame], tuple[Finding, ...]]:
        """The photographs with their cameras, and findings."""
        ...


def load_phone_capture(folder: Path) -> tuple[SurfaceMesh, tuple[Photograph, ...]]:
    """Load page and photographs of a folder that Polycam or 3d Scanner App exported.

    The surface is z up, with the photograph that faces it most as its texture; the cameras are in its frame. Raises
    BadInput for a damaged export, NotEnoughSurface when its photographs show no paper on its mesh.
    """
    program, reader = _reader(folder)
    mesh = reader.read_mesh(folder)
    frames, findings = reader.read_frames(folder)
    if not frames:
        raise BadInput(f"{folder} holds no photograph with its camera", HINT)
    photographs = [_photograph(frame) for frame in _chosen(frames)]
    page, photographs = _upright(*_page_of(mesh, photographs))
    facts = {"device": program, "unit": "m", "unit_source": "given", "frames": len(frames)}
    facts |= {"photographs": [photograph.name for photograph in photographs]}
    findings = (*findings, Finding.of("coarse_mesh"))
    return replace(page, provenance=facts, findings=findings), tuple(photographs)


def _reader(folder: Path) -> tuple[str, Reader]:
    """The program's name and the reader of a folder that one of them exported."""
    return ("Polycam", polycam) if is_polycam(folder) else ("3d Scanner App", scanner_app)


def _chosen(frames: Sequence[Frame]) -> list[Frame]:
    runs = np.array_split(np.arange(len(frames)), min(MAX_FRAMES, len(frames)))
    return [max((frames[k] for k in run), key=lambda frame: frame.sharpness) for run in runs]


def _photograph(frame: Frame) -> Photograph:
    photograph = read_photograph(frame.picture)
    height, width = photograph.image.shape[:2]
    if (width, height) != frame.camera.size:
        raise BadInput(
            f"{frame.picture} has {width} × {height} pixels, not the {frame.camera.size[0]} × {frame.camera.size[1]} "
            "of its camera",
            "export the capture again: its images must be as they were taken",
        )
    return replace(photograph, camera=frame.camera)


def _page_of(mesh: SurfaceMesh, photographs: Sequence[Photograph]) -> tuple[SurfaceMesh, list[Photograph]]:
    """Return the part of a mesh that most photographs show as paper.

    The largest piece; and the photographs, the one first that faces it most.
    """
    cameras = [photograph.camera for photograph in photographs if photograph.camera is not None]
    masks = find_paper([photograph.image for photograph in photographs], [CardInView()] * len(photographs))
    welded = weld(validated(mesh))
    fine = _subdivided(_shown(welded, masks, cameras))
    on_paper = _votes(fine, masks, cameras)
    kept = fine.faces[on_paper[fine.faces].all(axis=1)]
    if len(kept) < 2:
        raise NotEnoughSurface("the photographs show no paper on the mesh", HINT)
    page = validated(select(fine, kept))
    largest = max(large_pieces(page), key=lambda piece: surface_area(page.vertices, page.faces[piece]))
    page_mesh = select(page, page.faces[largest])
    if surface_area(page_mesh.vertices, page_mesh.faces) < MIN_AREA_MM2:
        raise NotEnoughSurface("the photographs show hardly any paper on the mesh", HINT)
    best = _facing(page_mesh, cameras)
    return page_mesh, [photographs[best], *photographs[:best], *photographs[best + 1 :]]


def _shown(mesh: SurfaceMesh, masks: PaperMasks, cameras: Sequence[PhotoCamera]) -> SurfaceMesh:
    """Return the faces of a mesh on paper, and their neighbours.

    A corner or the centre of a face is on paper.
    """
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    near = masks.votes(cameras, middles)[0] > 0
    touched = np.zeros(len(mesh.vertices), bool)
    touched[mesh.faces[near]] = True
    touched |= masks.votes(cameras, mesh.vertices)[0] > 0
    faces = mesh.faces[touched[mesh.faces].any(axis=1)]
    if not len(faces):
        raise NotEnoughSurface("the photographs show no paper on the mesh", HINT)
    return select(mesh, faces)


def _subdivided(mesh: SurfaceMesh) -> SurfaceMesh:
    """Return the same surface with edges of FINE_MM at most.

    Each face is split in four as often as that takes.
    """
    from trimesh.remesh import subdivide

    vertices, faces = mesh.vertices, mesh.faces
    for _ in range(MAX_SUBDIVISIONS):
        corners = vertices[faces]
        if np.quantile(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), 0.9) < FINE_MM:
            break
        if 4 * len(faces) > MAX_FACES:
            raise BadInput("the photographs show more paper than any page has, or the mesh is not in metres", HINT)
        vertices, faces = subdivide(vertices, faces)
    return SurfaceMesh(np.asarray(vertices, np.float64), np.asarray(faces, np.int64))


def _votes(mesh: SurfaceMesh, masks: PaperMasks, cameras: Sequence[PhotoCamera]) -> Mask:
    """Return the vertices (n,) that most views show on paper, of the views that show them."""
    fraction, count = masks.votes(cameras, mesh.vertices)
    return (fraction > MAX_VIEWS) & (count > 0)


def _facing(mesh: SurfaceMesh, cameras: Sequence[PhotoCamera]) -> int:
    """The camera that looks down on a mesh most steeply and shows most of it."""
    middle, merits = mesh.vertices.mean(axis=0), []
    for camera in cameras:
        pixels, way = camera.project(mesh.vertices), camera.position - middle
        inside = ((pixels > 0) & (pixels < np.array(camera.size) - 1)).all(axis=1).mean()
        merits.append(inside * way[2] / float(np.linalg.norm(way)))
    return int(np.argmax(merits))


def _upright(mesh: SurfaceMesh, photographs: Sequence[Photograph]) -> tuple[SurfaceMesh, list[Photograph]]:
    """Rotate page and photographs about the vertical until upright.

    The sides are then along x and y, and up as the first photograph has it, which is the texture of the mesh; the faces
    run counter-clockwise seen from above.
    """
    first = photographs[0].camera
    assert first is not None
    _, _, side = cv2.minAreaRect(mesh.vertices[:, :2].astype(np.float32))
    up = np.degrees(np.arctan2(-first.rotation[1, 1], -first.rotation[1, 0]))
    quarter = round((up - 90.0 - side) / 90.0)  # turns by which a side is nearest to its up
    turn = np.radians(-(side + 90.0 * quarter))
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1.0]])
    motion = Similarity(1.0, rotation, np.zeros(3))
    turned = [replace(one, camera=one.camera and motion.camera(one.camera)) for one in photographs]
    vertices, faces = motion.points(mesh.vertices), mesh.faces
    if vertex_normals(vertices, faces)[:, 2].mean() < 0:
        faces = faces[:, ::-1]
    camera = turned[0].camera
    assert camera is not None
    return SurfaceMesh(vertices, faces, camera.project(vertices), turned[0].image), turned
