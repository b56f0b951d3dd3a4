"""Refuse one-sided surfaces, closed bands and strips without a width."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from restore.errors import BadInput
from restore.mesh.adjacency import components
from restore.mesh.measures import corner_angles, straight_lengths
from restore.mesh.topology import Topology
from restore.scan import Floats

NARROW = 1e4  # times as long as wide: rounding, magnified by its square, bends a strip by 10⁻⁵ of its length there


def refuse_unflattenable(vertices: Floats, topology: Topology) -> None:
    """Raise BadInput for a mesh that is one-sided or a closed band.

    Only meshes without flaws are checked: no edge has more than two faces, and no border meets itself in a vertex.
    vertices: (n, 3) mm.
    """
    faces, sides, counts = topology.faces, topology.sides, topology.face_counts
    inner = np.flatnonzero(counts == 2)
    one, other = (faces.ravel()[sides.at[sides.first[inner] + k]] for k in (0, 1))  # where either side starts
    border = sides.edges[counts == 1]
    ends = np.bincount(border.ravel(), minlength=len(vertices))
    if counts.max() > 2 or (ends[border] != 2).any():
        return
    if (one == other).any():
        raise BadInput("the surface has one side only, as a Möbius strip has", "cut the page out of the mesh")
    if np.count_nonzero(np.bincount(faces.ravel())) - len(sides.edges) + len(faces) != 0:  # Euler: a band has 0
        return
    loop = components(border, len(vertices))
    corners = corner_angles(faces, sides, straight_lengths(vertices, sides.edges))
    angles = np.bincount(faces.ravel(), corners, len(vertices))
    turning = np.bincount(loop, np.where(ends > 0, np.pi - angles, 0.0))
    loops = np.unique(loop[np.unique(border)])
    # In a flat page the border turns by 2π, a hole by −2π; both borders of a band turn by nothing.
    if len(loops) == 2 and (np.abs(turning[loops]) < np.pi).all():
        raise BadInput("the surface is a band closed on itself", "cut it open where the page begins")


def refuse_narrow(flat: Sequence[Floats], areas: Sequence[float]) -> None:
    """Raise BadInput when the largest of some pieces is a strip without a width.

    flat: (n, 2) mm, positions of each piece. areas: in mm², at rest. The edges of such a strip hardly change in length
    when it bends in the plane: its lengths do not determine its form.
    """
    largest = int(np.argmax(areas))
    length, area = float(np.hypot(*np.ptp(flat[largest], axis=0))), areas[largest]
    if length * length > NARROW * area:
        raise BadInput(
            f"the surface is a strip about {length:.4g} mm long and {area / length:.2g} mm wide: it is too narrow",
            "check the unit and the axes of the mesh",
        )
