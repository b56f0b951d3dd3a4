"""Meshes of a sheet as users have them: even and uneven points, grids, and what decimators leave of a dense mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay
from scipy.stats.qmc import Halton, PoissonDisk

from bench.families.sheets import PAGE_MM, Warp, random_sheet
from drivers.simulated.imaging.raycast import load_open3d
from restore.mesh.measures import surface_area
from restore.mesh.triangulate import compact
from restore.scan import Floats, Ints, SurfaceMesh

DENSE = 8  # times the points of the decimated mesh, at least …
MIN_DENSE = 20_000
DISTANCE_MM = 900.0
MAX_NOISE_MM = 0.3
MAX_FOLDED = 0.05  # of the faces
SIZES_MM = (20.0, 2000.0)  # width of the page
SLIVER, FOLDED = 0.97, 1.2  # of the way to the opposite side that a corner is moved
FLATTEST = 1e-6  # of the spacing squared: Delaunay leaves faces without area along straight borders
STRETCH, GRADING = 10.0, 10.0  # anisotropy, and spacing at one end over the other


@dataclass(frozen=True, eq=False)
class Sample:
    """A mesh of a random sheet: how it was made, its noise in mm on a page of 280 mm, and its flat truth (n, 2) mm."""

    family: str
    sampler: str
    noise_mm: float
    mesh: SurfaceMesh
    flat: Floats


def random_sample(seed: int, points: int) -> Sample:
    """The sample of a seed, about `points` vertices."""
    rng = np.random.default_rng([seed, points])
    spacing = float(np.sqrt(np.prod(PAGE_MM) / points))
    family, sheet = random_sheet(rng, spacing)
    sampler = str(rng.choice([*DIRECT, *DECIMATORS]))
    before, after = (rng.uniform(0, MAX_NOISE_MM) if rng.random() < 0.4 else 0.0 for _ in range(2))
    if sampler in DIRECT:
        flat, faces = joined(DIRECT[sampler](points, rng))
        if rng.random() < 0.3:
            flat = spoilt(flat, faces, rng)
        vertices, before = sheet(flat), 0.0
    else:
        vertices, faces, flat = decimated(sheet, points, before, DECIMATORS[sampler])
    vertices = vertices + after * rng.normal(size=(len(vertices), 1)) * _sight(vertices)
    scale = float(np.exp(rng.uniform(*np.log(SIZES_MM)))) / PAGE_MM[0]
    mesh = SurfaceMesh(scale * (vertices - [0, 0, DISTANCE_MM]), faces)
    return Sample(family, sampler, float(np.hypot(before, after)), mesh, scale * flat)


def _sight(vertices: Floats) -> Floats:
    sight = vertices - vertices.mean(axis=0) - [0.0, 0.0, DISTANCE_MM]
    return np.asarray(sight / np.linalg.norm(sight, axis=1)[:, None])


def joined(flat: Floats) -> tuple[Floats, Ints]:
    """Points (n, 2) mm with their Delaunay triangles (m, 3), counter-clockwise."""
    faces = Delaunay(flat).simplices.astype(np.int64)
    doubled = _doubled(flat, faces)
    faces = np.where(doubled[:, None] > 0, faces, faces[:, ::-1])
    kept = np.abs(doubled) > FLATTEST * np.prod(PAGE_MM) / len(flat)
    flat, faces = compact(flat, faces[kept])
    return flat, faces


def _doubled(flat: Floats, faces: Ints) -> Floats:
    a, b, c = (flat[faces[:, k]] for k in range(3))
    return np.asarray((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]))


def spoilt(flat: Floats, faces: Ints, rng: np.random.Generator) -> Floats:
    """The points with up to MAX_FOLDED of the faces folded over or made slivers: a corner is moved over its side."""
    flat, chosen = flat.copy(), rng.permutation(len(faces))[: int(rng.uniform(0, MAX_FOLDED) * len(faces))]
    inner = np.abs(flat) < 0.45 * np.array(PAGE_MM)
    touched = np.zeros(len(flat), bool)
    for face in faces[chosen]:
        if touched[face].any() or not inner[face].all():
            continue
        middle = flat[face[1:]].mean(axis=0)
        flat[face[0]] += rng.choice([SLIVER, FOLDED]) * (middle - flat[face[0]])
        touched[face] = True
    return flat


def _with_border(inner: Floats, points: int) -> Floats:
    """Inner points in the unit square, and even ones along its border, on the page."""
    step = np.sqrt(np.prod(PAGE_MM) / points)
    across, up = (round(side / step) for side in PAGE_MM)
    x, y = np.linspace(0, 1, across + 1)[:-1], np.linspace(0, 1, up + 1)[:-1]
    quarter = [np.stack([x, 0 * x], 1), np.stack([0 * y + 1, y], 1)]
    border = np.concatenate([*quarter, *(1 - side for side in quarter)])
    margin = 0.5 * step / np.array(PAGE_MM)
    return np.asarray((np.concatenate([border, margin + inner * (1 - 2 * margin)]) - 0.5) * PAGE_MM)


def _halton(points: int, rng: np.random.Generator) -> Floats:
    return _with_border(Halton(2, seed=rng).random(points), points)


def _poisson(points: int, rng: np.random.Generator) -> Floats:
    return _with_border(PoissonDisk(2, radius=0.8 / np.sqrt(points), rng=rng).random(points), points)


def _lattice(columns: int, rows: int) -> Floats:
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, columns), np.linspace(-0.5, 0.5, rows))
    return np.stack([x.ravel(), y.ravel()], axis=1) * PAGE_MM


def _grid(points: int, _: np.random.Generator) -> Floats:
    step = np.sqrt(np.prod(PAGE_MM) / points)
    return _lattice(round(PAGE_MM[0] / step) + 1, round(PAGE_MM[1] / step) + 1)


def _stretched(points: int, rng: np.random.Generator) -> Floats:
    """A grid up to STRETCH times denser one way."""
    step, stretch = np.sqrt(np.prod(PAGE_MM) / points), np.sqrt(rng.uniform(2, STRETCH))
    columns, rows = round(PAGE_MM[0] / step * stretch) + 1, round(PAGE_MM[1] / step / stretch) + 1
    return _lattice(columns, max(rows, 3))


def _graded(points: int, rng: np.random.Generator) -> Floats:
    """Halton points that grow denser from one end of the page to the other, up to GRADING times."""
    ratio = rng.uniform(2, GRADING)
    flat = _with_border(Halton(2, seed=rng).random(points), points) / PAGE_MM[0] + [0.5, 0.0]
    x = np.log1p((ratio - 1) * flat[:, 0]) / np.log(ratio)
    return np.stack([(x - 0.5) * PAGE_MM[0], flat[:, 1] * PAGE_MM[0]], axis=1)


DIRECT: dict[str, Callable[[int, np.random.Generator], Floats]] = {
    "Halton": _halton,
    "Poisson disc": _poisson,
    "grid": _grid,
    "stretched grid": _stretched,
    "graded": _graded,
}


def decimated(sheet: Warp, points: int, noise_mm: float, run: Decimator) -> tuple[Floats, Ints, Floats]:
    """Vertices (n, 3), faces (m, 3) of a dense noisy mesh reduced to about `points`, and their flat truth (n, 2).

    The truth of a vertex is that of the nearest point of the dense surface without noise.
    """
    rng = np.random.default_rng(0)
    flat, dense = joined(_grid(max(DENSE * points, MIN_DENSE), rng))
    clean = sheet(flat)
    noisy = clean + noise_mm * np.random.default_rng(len(flat)).normal(size=(len(clean), 1)) * _sight(clean)
    vertices, faces = run(noisy, dense, points)
    vertices, faces = compact(vertices, faces)
    return vertices, faces, _nearest(clean, dense, flat, vertices)


def _nearest(clean: Floats, dense: Ints, flat: Floats, vertices: Floats) -> Floats:
    import igl

    _, face, foot = igl.point_mesh_squared_distance(vertices, clean, dense)
    corners = [np.ascontiguousarray(clean[dense[face, k]]) for k in range(3)]
    shares = igl.barycentric_coordinates(np.ascontiguousarray(foot), *corners)
    return np.asarray(np.einsum("nk,nkd->nd", shares, flat[dense[face]]))


Decimator = Callable[[Floats, Ints, int], tuple[Floats, Ints]]


def _pymeshlab(*, preservenormal: bool, optimalplacement: bool) -> Decimator:
    def run(vertices: Floats, faces: Ints, points: int) -> tuple[Floats, Ints]:
        import pymeshlab

        meshes = pymeshlab.MeshSet()
        meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=2 * points, preservenormal=preservenormal, optimalplacement=optimalplacement
        )
        found = meshes.current_mesh()
        return np.array(found.vertex_matrix(), float), np.array(found.face_matrix(), np.int64)

    return run


def _fast(vertices: Floats, faces: Ints, points: int) -> tuple[Floats, Ints]:
    import fast_simplification

    found, triangles = fast_simplification.simplify(
        vertices.astype(np.float32), faces.astype(np.int32), target_count=2 * points
    )
    return found.astype(float), triangles.astype(np.int64)


def _open3d(vertices: Floats, faces: Ints, points: int) -> tuple[Floats, Ints]:
    open3d = load_open3d()
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(vertices), open3d.utility.Vector3iVector(faces.astype(np.int32))
    )
    found = mesh.simplify_quadric_decimation(2 * points)
    return np.asarray(found.vertices).copy(), np.asarray(found.triangles).astype(np.int64)


DECIMATORS: dict[str, Decimator] = {
    "quadric": _pymeshlab(preservenormal=False, optimalplacement=True),
    "quadric, normals": _pymeshlab(preservenormal=True, optimalplacement=True),
    "quadric, vertices": _pymeshlab(preservenormal=False, optimalplacement=False),
    "fast-simplification": _fast,
    "open3d": _open3d,
}


def page_size(sample: Sample) -> float:
    """Width in mm of a page of the same area and the bench's shape."""
    return float(np.sqrt(surface_area(sample.flat, sample.mesh.faces) * PAGE_MM[0] / PAGE_MM[1]))
