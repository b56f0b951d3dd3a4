"""Recover the range grid of a mesh that is one shot of the scanner.

Every sample of a shot lies on the line of sight of one pixel, so (x/−z, y/−z) of its vertices falls on a lattice; the
pitch of the lattice is one over the focal length in samples. A moved, merged or decimated mesh has no such lattice.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import distance_transform_edt

from restore.camera.rays import ASPECT_TOLERANCE, MAX_SCATTER
from restore.findings import Finding
from restore.numerics.robust import MAJORITY, NEARLY_ALL
from restore.runtime.threads import in_threads
from restore.scan import Bytes, Floats, Ints, Mask, RangeScan, SurfaceMesh, with_findings
from restore.vivid import FOCAL_PX, TEXTURE_COLS, TEXTURE_ROWS, WRITTEN_MM

# Image pixels per sample: FINE takes every pixel, FAST every second; exports thin them further.
PIXELS_PER_SAMPLE = (1, 2, 3, 4)
# A lens differs from the nominal one by a percent or two; the candidates above lie 7 percent apart at least.
FOCAL_TOLERANCE = 0.03
IMAGE_SIZE = (TEXTURE_COLS, TEXTURE_ROWS)

MIN_LINES = 4  # rows and columns of a grid
MAX_LINES = 2048  # beyond the largest range cameras of the scanner's family (1280 × 1024)
MIN_DEPTH_MM = 1.0  # in front of the lens
MAX_SHARED_CELLS = 0.01  # fraction of vertices in a cell that another vertex has taken
# Colour and range come from one camera: texture coordinates are an affine function of the grid to within the
# registration of the two exposures.
MAX_TEXTURE_SCATTER_PX = 2.0
SPECTRUM_BINS = 2**15  # 16 bins to a line at MAX_LINES
MIN_LINE_STRENGTH = 0.5  # of a perfect lattice; a scatter of 0.1 of the pitch leaves 0.82


@dataclass(frozen=True)
class Lines:
    """Parallel lines of a lattice: line k lies at first + k · pitch."""

    first: float
    pitch: float

    def number(self, tangents: Floats) -> Floats:
        """Return the line numbers (n,) of tangents (n,), with fractions."""
        return (tangents - self.first) / self.pitch


@dataclass(frozen=True, eq=False)
class Lattice:
    """Grid of a mesh.

    It holds its lines, the cell (row, col) of each vertex (n, 2), and the vertex of each cell or −1.
    """

    rows: Lines
    columns: Lines
    cells: Ints
    vertex_at: Ints

    @property
    def occupied(self) -> Mask:
        """Return which cells have a vertex, (rows, cols) bool."""
        return self.vertex_at >= 0

    @property
    def positions(self) -> Floats:
        """Return column and row of every cell, (rows, cols, 2)."""
        rows, cols = self.vertex_at.shape
        return np.stack(np.meshgrid(np.arange(cols), np.arange(rows)), axis=-1).astype(float)


def organise(mesh: SurfaceMesh, *, colours: Bytes | None = None) -> RangeScan | None:
    """Return the range grid that a mesh was made from.

    A surface that is the mirror image of its picture is mirrored, with a finding. Texture positions come from the
    mesh's texture coordinates; without them from the camera: the picture is taken through the same lens, whose focal
    length follows from the pitch. A picture that no lens fits is left out.
    colours: (n, 3) uint8 RGB, one a vertex; they give a picture of the size of the grid when the mesh has none.
    Returns None when the vertices are not the samples of one capture.
    """
    lattice = _find_lattice(mesh.vertices)
    if lattice is None or not _is_grid(lattice.occupied) or not _joins_neighbours(lattice.cells, mesh.faces):
        return None
    if mesh.texcoords is not None and np.linalg.det(_affine(mesh.texcoords, lattice)[:2]) < 0.0:
        return organise(_mirrored(mesh))
    lens = _lens(lattice)
    if mesh.texcoords is not None:
        texture, texture_xy = mesh.texture, _texture_positions(mesh.texcoords, lattice)
    elif mesh.texture is None and colours is not None:
        texture, texture_xy = _picture_from_colours(colours, lattice), lattice.positions
    else:
        texture, texture_xy = _camera_positions(mesh.texture, lattice, lens)
    if texture_xy is None:
        return None
    points = np.where(lattice.occupied[..., None], mesh.vertices[lattice.vertex_at], np.nan)
    facts = {**mesh.provenance, **({"lens": lens[0]} if lens else {})}
    return RangeScan(points, texture, texture_xy, facts, findings=mesh.findings)


def _find_lattice(vertices: Floats) -> Lattice | None:
    depth = -vertices[:, 2]
    if depth.size < MIN_LINES**2 or depth.min() < MIN_DEPTH_MM:
        return None
    right, down = vertices[:, 0] / depth, -vertices[:, 1] / depth
    columns, rows = in_threads(_find_lines, (right, down))
    if columns is None or rows is None:
        return None
    cells = np.rint(np.column_stack([rows.number(down), columns.number(right)])).astype(np.int64)
    vertex_at = _assign_vertices(vertices, cells)
    return None if vertex_at is None else Lattice(rows, columns, cells, vertex_at)


def _find_lines(tangents: Floats) -> Lines | None:
    """Return the lines on which one coordinate (n,) of all vertices lies.

    The first one is numbered 0. Returns None without lines.
    """
    low, span = float(tangents.min()), float(np.ptp(tangents))
    if span <= 0:
        return None
    bins = np.minimum((tangents - low) * (SPECTRUM_BINS / span), SPECTRUM_BINS - 1).astype(np.int64)
    histogram = np.bincount(bins, minlength=SPECTRUM_BINS).astype(float)
    # Twice the length: the true frequency is then never further than a quarter of a cycle from a sampled one.
    spectrum = np.fft.rfft(histogram, 2 * SPECTRUM_BINS)[: 2 * MAX_LINES + 1] / tangents.size
    strength = np.abs(spectrum)
    peaks = np.flatnonzero((strength[1:-1] > strength[:-2]) & (strength[1:-1] >= strength[2:])) + 1
    # The fundamental comes before its harmonics.
    for peak in peaks[(strength[peaks] > MIN_LINE_STRENGTH) & (peaks > 2 * (MIN_LINES - 2))]:
        pitch = span / (0.5 * float(peak))
        phase = -float(np.angle(spectrum[peak])) / (2.0 * np.pi)
        lines = _fit_lines(tangents, Lines(low + span / (2 * SPECTRUM_BINS) + phase * pitch, pitch))
        if lines is not None:
            return lines
    return None


def _fit_lines(tangents: Floats, lines: Lines) -> Lines | None:
    number = np.rint(lines.number(tangents))
    for _ in range(3):  # fitting and numbering by turns; the first numbering is right already for nearly all
        mean = float(number.mean())
        centred = number - mean
        square = float(centred @ centred)
        if square == 0:
            return None
        pitch = float(centred @ tangents) / square
        if pitch <= 0:
            return None
        lines, before = Lines(float(tangents.mean()) - pitch * mean, pitch), number
        position = lines.number(tangents)
        number = np.rint(position)
        if np.array_equal(number, before):
            break
    # In pitches; a mesh that is on no lattice scatters by 0.29 (uniform).
    if np.std(position - number) > MAX_SCATTER or not MIN_LINES - 1 <= np.ptp(number) < MAX_LINES:
        return None
    return Lines(lines.first + lines.pitch * float(number.min()), lines.pitch)


def _assign_vertices(vertices: Floats, cells: Ints) -> Ints | None:
    """Return the vertex in each cell, (rows, cols), −1 for empty ones.

    Returns None when too many fall into one cell.
    """
    shape = cells.max(axis=0) + 1
    flat = cells[:, 0] * shape[1] + cells[:, 1]
    occupied_cells, first, inverse = np.unique(flat, return_index=True, return_inverse=True)
    distinct = np.abs(vertices - vertices[first[inverse]]).max(axis=1) > 2 * WRITTEN_MM
    if distinct.mean() > MAX_SHARED_CELLS:
        return None
    vertex_at = np.full(int(shape.prod()), -1, dtype=np.int64)
    vertex_at[occupied_cells] = first
    return vertex_at.reshape(shape)


def _is_grid(occupied: Mask) -> bool:
    """Return whether most samples have a neighbour to the right and one below.

    Holes and a jagged outline cost a tenth; on half of the true pitch hardly a sample has them after decimation.
    """
    right, below = occupied[:, 1:] & occupied[:, :-1], occupied[1:] & occupied[:-1]
    return bool(min(right.sum(), below.sum()) > MAJORITY * occupied.sum())


def _joins_neighbours(cells: Ints, faces: Ints) -> bool:
    rows, cols = (axis.astype(np.int32)[faces.T] for axis in cells.T)  # one axis at a time: a large mesh has many faces
    near = [
        np.count_nonzero((np.abs(rows[a] - rows[b]) <= 1) & (np.abs(cols[a] - cols[b]) <= 1))
        for a, b in ((0, 1), (1, 2), (2, 0))
    ]
    return bool(sum(near) > NEARLY_ALL * faces.size)


def _lens(lattice: Lattice) -> tuple[str, int] | None:
    """The lens and the image pixels per sample that match the pitch, or None."""
    samples = 2.0 / (lattice.columns.pitch + lattice.rows.pitch)
    candidates = itertools.product(FOCAL_PX, PIXELS_PER_SAMPLE)
    error = {(lens, k): abs(np.log(k * samples / FOCAL_PX[lens])) for lens, k in candidates}
    best = min(error, key=error.__getitem__)
    return best if error[best] < FOCAL_TOLERANCE else None


def _mirrored(mesh: SurfaceMesh) -> SurfaceMesh:
    """The mirror image of a surface, left for right, with a warning."""
    turned = replace(mesh, vertices=mesh.vertices * [-1.0, 1.0, 1.0], faces=mesh.faces[:, ::-1])
    return with_findings(turned, Finding.of("mirrored"))


def _affine(texcoords: Floats, lattice: Lattice) -> Floats:
    """Fit texture coordinates (n, 2) per column and row of the grid.

    Returns (3, 2) pixels: the two changes, and the mean.
    """
    design = _design(lattice)
    return np.asarray(np.linalg.solve(design @ design.T, design @ texcoords), np.float64)


def _design(lattice: Lattice) -> Floats:
    """Return the design matrix (3, n) of an affine fit over the grid.

    Columns and rows of the vertices, centred for a well-conditioned fit, and ones.
    """
    rows, cols = lattice.cells.T.astype(np.float64)
    return np.stack([cols - cols.mean(), rows - rows.mean(), np.ones_like(cols)])


def _texture_positions(texcoords: Floats, lattice: Lattice) -> Floats | None:
    """Return the texture coordinates (rows, cols, 2) of the cells.

    The mesh's own where a cell has a vertex, their affine extrapolation elsewhere. None when they are not affine in the
    grid: the picture is not the camera's view.
    """
    affine = _affine(texcoords, lattice)
    scatter = np.sqrt(np.mean((affine.T @ _design(lattice) - texcoords.T) ** 2))
    if scatter > MAX_TEXTURE_SCATTER_PX or np.linalg.det(affine[:2]) <= 0:
        return None
    height, width = lattice.occupied.shape
    row, col = lattice.cells.mean(axis=0)
    along, down = (np.arange(width) - col)[:, None], (np.arange(height) - row)[:, None, None]
    positions = along * affine[0] + (down * affine[1] + affine[2])
    positions[lattice.occupied] = texcoords[lattice.vertex_at[lattice.occupied]]
    return positions


def _picture_from_colours(colours: Bytes, lattice: Lattice) -> Bytes:
    """Return a picture (rows, cols, 3) with one pixel for each cell.

    Empty cells have the colour of the nearest vertex.
    """
    nearest = distance_transform_edt(~lattice.occupied, return_distances=False, return_indices=True)
    return colours[lattice.vertex_at[tuple(nearest)]]


def _camera_positions(
    picture: Bytes | None, lattice: Lattice, lens: tuple[str, int] | None
) -> tuple[Bytes | None, Floats]:
    """Return the picture and the positions of the cells in it.

    The positions are (rows, cols, 2); the picture is None when it does not fit the lens.
    """
    width, height = IMAGE_SIZE if picture is None else picture.shape[1::-1]
    same_view = abs(width * IMAGE_SIZE[1] / (height * IMAGE_SIZE[0]) - 1.0) < ASPECT_TOLERANCE
    if lens is None or not same_view:
        return None, lattice.positions
    scale = lens[1] * width / IMAGE_SIZE[0]
    axis = np.array([lattice.columns.number(np.zeros(1))[0], lattice.rows.number(np.zeros(1))[0]])
    return picture, np.array([width - 1, height - 1]) / 2.0 + scale * (lattice.positions - axis)
