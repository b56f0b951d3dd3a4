"""How a simulated scene is lit, and how it shades itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.scene.light import FAR_MM, GOLDEN, Lamp, Light
from restore.scan import Floats, Ints

LIFT_MM = 0.1  # rays to the light start this far above the paper: single precision must not shadow it by itself
SKY_RAYS = 64  # light from all sides is as many rays, each as likely as light is to come from there


def irradiance(light: Light, maps: FaceMaps, face: Ints, points: Floats, depth_mm: float) -> list[NDArray[np.float32]]:
    """Return unshadowed light (n, 3) at points on faces (n,), of the room, then of each lamp.

    points: (n, 3) mm.
    depth_mm: where a lamp's fraction is meant: on the axis, at this depth.
    """
    normals = maps.facing(face, points)
    room = 1 + normals[:, :2] @ np.array(light.lean)
    fields = [light.ambient * np.multiply.outer(room, light.ambient_colour).astype(np.float32)]
    for lamp in light.lamps:
        way = np.array(lamp.at_mm) - points
        far = np.linalg.norm(way, axis=1)
        straight = np.array(lamp.at_mm) + [0, 0, depth_mm]
        reference = straight[2] / np.linalg.norm(straight) ** 3
        cosine = np.clip(np.einsum("ij,ij->i", normals, way) / far, 0, None)
        fields.append((lamp.share * np.multiply.outer(cosine / far**2 / reference, lamp.colour)).astype(np.float32))
    return fields


def lamp_visibility(lamp: Lamp, caster: RayCaster, normals: Floats, points: Floats) -> Floats:
    """Return how much of a lamp points see, 0 to 1, (n,).

    normals, points: (n, 3) and (n, 3) mm.
    """
    start = points + LIFT_MM * normals
    return np.asarray(np.mean([_clear(caster, start, place - start) for place in lamp.points()], axis=0))


def sky_view_factor(caster: RayCaster, normals: Floats, points: Floats) -> Floats:
    """Return how much of the light from all sides points see, (n,), 0 to 1.

    normals, points: (n, 3) and (n, 3) mm.
    """
    start = points + LIFT_MM * normals
    seen = [_clear(caster, start, FAR_MM * sky_direction(normals, k)) for k in range(SKY_RAYS)]
    return np.asarray(np.mean(seen, axis=0))


def sky_direction(normals: Floats, k: int) -> Floats:
    """Return the k-th direction (n, 3) of diffuse light, cosine-weighted about normals (n, 3)."""
    reach, turn = np.sqrt((k + 0.5) / SKY_RAYS), GOLDEN * k
    side = np.cross(normals, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(normals, side)
    return np.asarray(reach * (np.cos(turn) * side + np.sin(turn) * other) + np.sqrt(1 - reach**2) * normals)


def _clear(caster: RayCaster, start: Floats, way: Floats) -> Floats:
    """Return 1.0 where a path to the light meets nothing, (n,).

    start, way: (n, 3).
    """
    length = np.linalg.norm(way, axis=1, keepdims=True)
    face, reach = caster.first_hits(start, way / length)
    return np.asarray((face < 0) | (reach > length[:, 0])).astype(float)
