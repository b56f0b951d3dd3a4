"""`python -m bench.covered_views [--seed S] [--sets 8] [--width 1200]`: what passes for a cover in photographs.

Sheets of all kinds are photographed by hand; half of the views of a set have something over the page, the others
nothing. The surface is known but for SURFACE_MM, the cameras exactly, as a good reconstruction leaves them. One of the
views is the texture of the surface, in every second set one with something over the page. Printed are
the views with nothing over the page of which something is said, and of each kind of cover the views of which nothing is
said and how much of what it hides is painted. Sheets, print, poses, light and covers are drawn from the seed.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import cv2
import numpy as np

from bench.covered_photos import shot_of
from bench.covers import KINDS
from bench.draws import seed_of_today
from bench.photographs import SHEETS, photographed
from oracles.simulation.camera import Camera
from oracles.simulation.photographs import PhotographSet, Shots
from restore import FlatMesh, SurfaceMesh
from restore.camera.photo_camera import PhotoCamera, project_map
from restore.mesh.measures import vertex_normals
from restore.mesh.ordered_grid import grid_faces
from restore.photo.coarse import COARSE_DPI, COARSE_MM
from restore.photo.sources import Source, plan
from restore.scan import Bytes, Mask
from restore.texture.page import extend_edge_colours, page_map

VIEWS = 8
MESH_MM = 1.0  # of the mesh, as that of a reconstruction
SURFACE_MM, WAVE_MM = 0.1, 40.0  # rms of the surface's error along its normals, and its wavelength
ROW = "{:<11} {:>6} {:>7} {:>10} {:>10}"


def main(seed: int | None, sets: int, width: int, sheets: Sequence[str]) -> None:
    """Print a line for each set, and a table of what was over the page."""
    seed = seed or seed_of_today()
    print(f"{sets} sets of {VIEWS} views of {width} × {width * 3 // 4}, seed {seed}; cm² taken for a cover")
    table: dict[str, list[tuple[float, float, float]]] = {}
    for number in range(sets):
        rng = np.random.default_rng([seed, number])
        kind = sheets[number % len(sheets)]
        shots = Shots(size=(width, width * 3 // 4))
        taken = photographed(SHEETS[kind].draw(rng), int(rng.integers(2**31)), VIEWS, shots)
        cells = []
        for over, found, hidden, left in _set(taken, number, rng):
            table.setdefault(over, []).append((found, hidden, left))
            cells.append(f"{over} {found:.1f}")
        print(f"{kind:<10}", ", ".join(cells), flush=True)
    print(ROW.format("over it", "views", "silent", "hidden", "left"))
    for over, results in table.items():
        found, hidden, left = np.transpose(results)
        print(ROW.format(over, len(results), int((found == 0).sum()), f"{hidden.sum():.0f}", f"{left.sum():.2f}"))


def _set(taken: PhotographSet, number: int, rng: np.random.Generator) -> list[tuple[str, float, float, float]]:
    """Of each view: what is over the page, and cm² taken for a cover, hidden, and hidden but taken for page."""
    cameras = [_as_found(camera) for camera in taken.cameras]
    textured_from = number % 2
    page = _page(taken, cameras[textured_from], rng)
    names, pictures, covers = [], [], []
    for k, (image, camera) in enumerate(zip(taken.images, taken.cameras, strict=True)):
        names.append("nothing" if k % 2 == 0 else list(KINDS)[(VIEWS * number + k) // 2 % len(KINDS)])
        covered = KINDS[names[k]](shot_of(page, camera, image), rng) if k % 2 else None
        pictures.append(image if covered is None else covered.image)
        covers.append(np.zeros(image.shape[:2], bool) if covered is None else covered.hidden)
    assert page.texcoords is not None
    texture = Source(extend_edge_colours(pictures[textured_from], page.texcoords, page.faces))
    sources = [Source(picture, camera) for picture, camera in zip(pictures, cameras, strict=True)]
    planned = plan(page, [texture, *sources])
    surface = page_map(page.flat, page.faces, page.vertices, COARSE_DPI)
    results = []
    for k, name in enumerate(names):
        hidden = _on_page(covers[k], cameras[k], surface)
        shown = (planned.ppi[k + 1] > 0) & np.isfinite(surface[..., 0])
        areas = (planned.covered[k + 1], hidden & shown, hidden & (planned.weights[k + 1] > 0.5))
        results.append((name, *(float(mask.sum() * COARSE_MM**2 / 100) for mask in areas)))
    return results


def _as_found(camera: Camera) -> PhotoCamera:
    turn = cv2.Rodrigues(np.asarray(camera.axes, float))[0].ravel()
    (k1, k2, k3), lens = camera.radial, (camera.focal_px, *camera.centre)
    vector = [*turn, *(-camera.axes @ camera.position), *lens, k1, k2, *camera.tangential, k3]
    return PhotoCamera(np.array(vector), camera.size)


def _page(taken: PhotographSet, camera: PhotoCamera, rng: np.random.Generator) -> FlatMesh:
    """The page with its exact flat positions, its surface off by SURFACE_MM."""
    width, height = taken.scene.printed.page_mm
    cols, rows = (round(side / MESH_MM) + 1 for side in (width, height))
    x, y = np.meshgrid(np.linspace(0, width, cols), np.linspace(height, 0, rows))
    flat, faces = np.column_stack([x.ravel(), y.ravel()]), grid_faces(np.ones((rows, cols), bool))
    vertices = taken.scene.surface(flat)
    way = rng.normal(size=(2, 2)) * 2 * np.pi / WAVE_MM
    error = SURFACE_MM * 2 * np.prod(np.sin(flat @ way + rng.uniform(0, 6, 2)), axis=1)
    vertices = vertices + error[:, None] * vertex_normals(vertices, faces)
    mesh = SurfaceMesh(vertices, faces, camera.project(vertices), taken.images[0])
    return FlatMesh.of(mesh, flat, np.empty(0), 0)


def _on_page(hidden: Mask, camera: PhotoCamera, surface: np.ndarray) -> Mask:
    """Where what hides the page in a photograph (h, w) does so on the coarse page."""
    pixels = np.nan_to_num(project_map(camera, surface), nan=-1.0)
    found: Bytes = cv2.remap(hidden.astype(np.uint8), pixels, None, cv2.INTER_NEAREST)
    return np.asarray(found > 0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--sets", type=int, default=len(SHEETS))
    parser.add_argument("--width", type=int, default=1200)
    parser.add_argument("--sheets", nargs="+", choices=tuple(SHEETS), default=tuple(SHEETS))
    options = parser.parse_args()
    main(options.seed, options.sets, options.width, options.sheets)
