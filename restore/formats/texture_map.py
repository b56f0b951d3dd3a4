"""Which way the texture coordinates of a mesh run: turned over where its charts meet so, and noted where mirrored."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import cv2
import numpy as np
from scipy.ndimage import map_coordinates

from restore.findings import Finding
from restore.mesh.orient import map_runs_back
from restore.mesh.places import SAME_PIXELS, first_at_place
from restore.numerics.limits import TINY
from restore.scan import Bytes, Floats, Ints, Mask, SurfaceMesh, with_findings

INSIDE_PX = 2.0  # from its border: what lies in a chart and not in the padding round it
MIN_SEAM = 30  # pairs of vertices across seams that tell anything
ALIKE = 0.5  # correlation of the colours on both sides of the seams that meet
BETTER = 0.5  # of what they lack to a full correlation may be left
CERTAIN = 4.0  # standard errors of a correlation by chance
AXES = {1: "v of the texture coordinates runs down the image", 0: "u of the texture coordinates runs to the left"}


def with_oriented_map(mesh: SurfaceMesh) -> SurfaceMesh:
    """A textured mesh with its texture coordinates turned over where the charts of an atlas do not meet otherwise.

    Its provenance notes a map that is mirrored to the faces, "mirrored".
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
    """The axis along which the coordinates (n, 2) have to be turned over, if that makes charts meet; None otherwise."""
    place = first_at_place(mesh.vertices)
    apart = (np.abs(texcoords - texcoords[place]) >= SAME_PIXELS).any(axis=1)
    if apart.sum() < MIN_SEAM:
        return None
    one, other = np.flatnonzero(apart), place[apart]
    inner = _moved_inside(mesh.faces, texcoords, apart | np.isin(np.arange(len(place)), other))
    smooth = cv2.blur(texture, (3, 3)).astype(np.float64)
    before, least = _alikeness(smooth, inner, one, other), max(ALIKE, CERTAIN / sqrt(len(one)))
    after = {axis: _alikeness(smooth, _turned_over(inner, texture, axis), one, other) for axis in AXES}
    best = max(after, key=after.__getitem__)
    return best if after[best] > least and 1.0 - after[best] < BETTER * (1.0 - before) else None


def _alikeness(picture: Floats, texcoords: Floats, one: Ints, other: Ints) -> float:
    """The correlation of the colours of vertices one (k,) with those of other (k,); 0 where either are all alike."""
    here, there = (
        np.stack([map_coordinates(channel, texcoords[side, ::-1].T, order=1) for channel in np.moveaxis(picture, 2, 0)])
        for side in (one, other)
    )
    here, there = (colours - colours.mean(axis=1, keepdims=True) for colours in (here, there))
    return float((here * there).sum() / max(sqrt(float((here**2).sum() * (there**2).sum())), TINY))


def _moved_inside(faces: Ints, texcoords: Floats, chosen: Mask) -> Floats:
    """Texture coordinates (n, 2), the chosen (n,) moved into their charts, towards the middle of their faces (m, 3)."""
    middles, count = np.zeros_like(texcoords), np.zeros(len(texcoords))
    of_faces = texcoords[faces].mean(axis=1)
    for corner in faces.T:
        np.add.at(middles, corner, of_faces)
        np.add.at(count, corner, 1.0)
    way = middles / np.maximum(count, 1.0)[:, None] - texcoords
    length = np.linalg.norm(way, axis=1)
    step = np.minimum(INSIDE_PX / np.maximum(length, INSIDE_PX), 0.5)
    return np.asarray(texcoords + np.where(chosen, step, 0.0)[:, None] * way)
