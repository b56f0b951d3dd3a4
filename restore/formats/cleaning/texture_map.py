"""Orientation of the texture coordinates of a mesh.

They are flipped where its charts meet so, and noted where mirrored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt
from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates

from restore.findings import Finding
from restore.mesh.orient import map_runs_back
from restore.mesh.places import SAME_PIXELS, first_at_place
from restore.numerics.limits import TINY
from restore.numerics.robust import MAJORITY, OUTLYING
from restore.scan import Bytes, Floats, Ints, Mask, SurfaceMesh, with_findings

INSETS_PX = (0.0, 1.0, 2.0)  # from the border of a chart: some atlases pad it, others leave half a pixel of it
SHIFTS = 8  # of one side along the other, by which chance is estimated
AXES = {1: "v of the texture coordinates runs down the image", 0: "u of the texture coordinates runs to the left"}


def with_oriented_map(mesh: SurfaceMesh) -> SurfaceMesh:
    """Return a mesh with its texture coordinates flipped if needed.

    That is where the charts of an atlas do not meet otherwise. The provenance of the mesh notes a map that is mirrored
    to the faces, "mirrored".
    """
    if mesh.texture is None or mesh.texcoords is None:
        return mesh
    axis = _axis_to_turn(mesh, mesh.texture, mesh.texcoords)
    if axis is not None:
        texcoords = _turned_over(mesh.texcoords, mesh.texture, axis)
        mesh = with_findings(replace(mesh, texcoords=texcoords), Finding.of("map_turned_over", axis=AXES[axis]))
    if mesh.texcoords is not None and map_runs_back(mesh.faces, mesh.texcoords):
        return replace(mesh, provenance={**mesh.provenance, "mirrored": True})
    return mesh


def _turned_over(texcoords: Floats, texture: Bytes, axis: int) -> Floats:
    turned = texcoords.copy()
    turned[:, axis] = texture.shape[1 - axis] - 1.0 - turned[:, axis]
    return turned


def _axis_to_turn(mesh: SurfaceMesh, texture: Bytes, texcoords: Floats) -> int | None:
    """Return the axis along which flipping makes charts meet, or None.

    texcoords: (n, 2).
    """
    place = first_at_place(mesh.vertices)
    apart = (np.abs(texcoords - texcoords[place]) >= SAME_PIXELS).any(axis=1)
    if not apart.any():
        return None
    one, other = np.flatnonzero(apart), place[apart]
    moved = apart | np.isin(np.arange(len(place)), other)
    inner = [_moved_inside(mesh.faces, texcoords, moved, inset) for inset in INSETS_PX]
    before, least = _seams(texture, inner, one, other), max(MAJORITY, OUTLYING / sqrt(len(one)))
    after = {
        axis: _seams(texture, [_turned_over(places, texture, axis) for places in inner], one, other) for axis in AXES
    }
    best = max(after, key=lambda axis: after[axis].alikeness)
    gain = before.differences - after[best].differences
    surely = gain.mean() > OUTLYING * gain.std() / sqrt(len(gain))  # letters on a few pairs may meet by chance
    better = surely and after[best].differences.mean() < MAJORITY * before.differences.mean()
    return best if better and after[best].alikeness > least else None


class _Seams(NamedTuple):
    """How the colours on both sides of seams meet.

    differences  (k,) of each pair, mean of channels, 0 to 255.
    alikeness    by how much less they differ than any two colours there: 1 for not at all, 0 where all are the same.
    """

    differences: Floats
    alikeness: float


def _seams(picture: Bytes, inner: Sequence[Floats], one: Ints, other: Ints) -> _Seams:
    """How the colours of vertices one (k,) meet those of other (k,).

    inner: texture coordinates (n, 2) at each inset; the pairs are compared at the inset where they are most alike. The
    alikeness is a correlation of absolute differences: some letters on white paper decide a correlation of squares,
    where a seam runs through them a pixel off.
    """
    here, there = (np.stack([colours_at(picture, at[side]).T for at in inner]) for side in (one, other))

    def apart(shift: int) -> Floats:  # of (insets, 3, k) colours
        return np.asarray(np.abs(here - np.roll(there, shift, axis=2)).mean(axis=1).min(axis=0))

    by_chance = np.mean([apart(len(one) * k // SHIFTS).mean() for k in range(1, SHIFTS)])
    differences = apart(0)
    return _Seams(differences, float(1.0 - differences.mean() / by_chance) if by_chance > TINY else 0.0)


def colours_at(picture: Bytes, places: Floats) -> Floats:
    """Sample a picture (h, w, 3) at places (k, 2) px.

    Returns colours (k, 3); beyond the border those at the border.

    >>> colours_at(np.array([[[9, 8, 7]]], np.uint8), np.array([[-2.0, 1.5]])).tolist()
    [[9.0, 8.0, 7.0]]
    """
    channels = np.moveaxis(picture.astype(np.float64), 2, 0)
    return np.stack([map_coordinates(one, places[:, ::-1].T, order=1, mode="nearest") for one in channels], axis=1)


def _moved_inside(faces: Ints, texcoords: Floats, chosen: Mask, inset: float) -> Floats:
    """Move chosen texture coordinates into their charts, towards the faces' centres (m, 3).

    texcoords: (n, 2).
    chosen: (n,).
    inset: pixels, at most half of the distance.
    """
    middles, count = np.zeros_like(texcoords), np.zeros(len(texcoords))
    of_faces = texcoords[faces].mean(axis=1)
    for corner in faces.T:
        np.add.at(middles, corner, of_faces)
        np.add.at(count, corner, 1.0)
    way = middles / np.maximum(count, 1.0)[:, None] - texcoords
    length = np.linalg.norm(way, axis=1)
    step = np.minimum(inset / np.maximum(length, 1.0), 0.5)
    return np.asarray(texcoords + np.where(chosen, step, 0.0)[:, None] * way)
