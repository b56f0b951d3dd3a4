"""The axis of a turntable in the scanner's frame, and how to find it from views of a board that it turned.

The way of operators of the Vivid, who scan a plate on the stage before the object; here the plate carries markers, so
that it may stand or lie as it likes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from restore.errors import BadInput
from restore.scan import Floats

LEAST_CORNERS = 8  # two markers: four corners of one lie too close together to tell a tilt
MOST_OFF_DEG = 0.5  # a stage turns to a hundredth of a degree; more, and the angles are not what the stage did
LEAST_TURN_DEG = 5.0  # off 0° and 180°: for less, the views do not tell where the axis is, or which way it turns


@dataclass(frozen=True, eq=False)
class RotationAxis:
    """Through point (3,) mm, along the unit vector direction (3,); turns are counter-clockwise seen against it."""

    point: Floats
    direction: Floats

    def turn(self, angle_deg: float) -> Floats:
        """(4, 4): where a turn takes points of the scanner's frame."""
        return _motion(self.point, np.radians(angle_deg) * self.direction)


@dataclass(frozen=True, eq=False)
class AxisFit:
    """An axis with what speaks for it.

    rms_mm      of the corners against where the turns would have taken them.
    turned_deg  what the stage turned, view by view, as the corners tell without being told.
    """

    axis: RotationAxis
    rms_mm: float
    turned_deg: tuple[float, ...]


def fit_axis(views: Sequence[Mapping[int, Floats]], turns_deg: Sequence[float]) -> AxisFit:
    """Find the axis from the corners of markers in two or more views, and the angles of the stage.

    views  for each view, marker → its corners (4, 3) mm in the scanner's frame.
    Raises BadInput when the views share too few markers, turn too little, or turned by other angles than told.
    """
    first, turns = views[0], np.asarray(turns_deg, float) - turns_deg[0]
    pairs = [_shared(first, view) for view in views[1:]]
    if not pairs or np.abs(np.sin(np.radians(turns))).max() < np.sin(np.radians(LEAST_TURN_DEG)):
        raise BadInput(
            "the views do not tell where the axis is and which way it turns",
            "turn the board between them by something else than half a turn: three views or more do",
        )
    rotations, shifts = zip(*(_rigid(before, after) for before, after in pairs), strict=True)
    start = _first_guess(np.array(rotations), np.array(shifts), turns[1:], np.concatenate([p[0] for p in pairs]))

    def off(unknown: Floats) -> Floats:
        return np.concatenate(
            [
                (_moved(_motion(unknown[:3], np.radians(turn) * _unit(unknown[3:])), before) - after).ravel()
                for turn, (before, after) in zip(turns[1:], pairs, strict=True)
            ]
        )

    found = least_squares(off, start, x_scale=np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3]))
    direction = _unit(found.x[3:])
    middle = np.concatenate([p[0] for p in pairs]).mean(axis=0)
    point = found.x[:3] + direction * ((middle - found.x[:3]) @ direction)  # of all points of the axis, the nearest
    turned = (0.0, *(_angle(rotation, direction) for rotation in rotations))
    _check_turns(turned, turns)
    return AxisFit(RotationAxis(point, direction), float(np.sqrt(np.mean(found.fun**2) * 3)), turned)


def _shared(first: Mapping[int, Floats], other: Mapping[int, Floats]) -> tuple[Floats, Floats]:
    markers = sorted(first.keys() & other.keys())
    if 4 * len(markers) < LEAST_CORNERS:
        raise BadInput(
            f"two views share {len(markers)} markers of the board",
            "put the board where every view sees most of it, and light it evenly",
        )
    before, after = (np.concatenate([view[marker] for marker in markers]) for view in (first, other))
    return before, after


def _rigid(before: Floats, after: Floats) -> tuple[Floats, Floats]:
    """Rotation (3, 3) and shift (3,) that take points (n, 3) to others with least squares (Kabsch)."""
    rotation, _ = Rotation.align_vectors(after - after.mean(axis=0), before - before.mean(axis=0))
    matrix = rotation.as_matrix()
    return matrix, after.mean(axis=0) - matrix @ before.mean(axis=0)


def _first_guess(rotations: Floats, shifts: Floats, turns: Floats, corners: Floats) -> Floats:
    """(6,) point and direction: what all rotations leave as it is."""
    rest = rotations - np.eye(3)
    direction = np.linalg.eigh(np.einsum("kji,kjl->il", rest, rest))[1][:, 0]
    if np.sin(np.radians(turns)) @ [np.sin(np.radians(_angle(r, direction))) for r in rotations] < 0:
        direction = -direction
    middle = corners.mean(axis=0)  # the point is sought from here: along the axis nothing tells where
    system = np.concatenate([-rest.reshape(-1, 3), direction[None]])
    wanted = np.append((shifts + rest @ middle).ravel(), 0.0)
    return np.concatenate([middle + np.linalg.lstsq(system, wanted, rcond=None)[0], direction])


def _check_turns(turned: Sequence[float], told: Floats) -> None:
    off = _wrapped(np.asarray(turned) - told)
    worst = int(np.argmax(np.abs(off)))
    if abs(off[worst]) > MOST_OFF_DEG:
        raise BadInput(
            f"the stage turned the board by {turned[worst] % 360:.2f}° when it was told {told[worst] % 360:.2f}°",
            "check `model` and `relative` in [stage], and that nothing slips",
        )


def _angle(rotation: Floats, direction: Floats) -> float:
    """Degrees by which a rotation turns about a direction."""
    return float(np.degrees(Rotation.from_matrix(rotation).as_rotvec() @ direction))


def _motion(point: Floats, turn: Floats) -> Floats:
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    motion[:3, 3] = point - motion[:3, :3] @ point
    return motion


def _moved(motion: Floats, points: Floats) -> Floats:
    return np.asarray(points @ motion[:3, :3].T + motion[:3, 3])


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))


def _wrapped(degrees: Floats) -> Floats:
    return np.asarray((degrees + 180.0) % 360.0 - 180.0)
