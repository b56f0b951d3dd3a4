"""The axis of a turntable in the scanner's frame.

It is found from views of a board on the turntable. Operators of the Vivid scan a plate on the turntable before the
object; here the plate carries markers, so that it may stand at any angle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from restore.errors import BadInput
from restore.runtime.arguments import checks_types
from restore.scan import Floats, RangeScan
from restore.turntable.board import board_corners

MIN_CORNERS = 8  # two markers: the four corners of one are too close together to determine a tilt
MAX_TURN_ERROR_DEG = 0.5  # a stage is accurate to a hundredth of a degree; more means wrong angles
MIN_TURN_DEG = 5.0  # from 0° and 180°: below, position and direction of the axis are not determined


@dataclass(frozen=True, eq=False)
class RotationAxis:
    """Axis through point (3,) mm along the unit vector direction (3,).

    Angles follow the right-hand rule.

    >>> upright = RotationAxis(np.array([0.0, 0.0, -900.0]), np.array([0.0, 1.0, 0.0]))
    >>> (upright.turn(90.0) @ [10.0, 0.0, -900.0, 1.0]).round(6).tolist()
    [0.0, 0.0, -910.0, 1.0]
    """

    point: Floats
    direction: Floats

    def turn(self, angle_deg: float) -> Floats:
        """Return the motion (4, 4) of a rotation about the axis, in the scanner's frame."""
        return _rotation_about(self.point, np.radians(angle_deg) * self.direction)


@dataclass(frozen=True, eq=False)
class AxisFit:
    """An axis with the residuals of its fit.

    rms_mm      distance of the corners from their positions predicted by the axis and the stage's angles.
    rotation_deg  angle of each view, measured from the corners alone.
    """

    axis: RotationAxis
    rms_mm: float
    rotation_deg: tuple[float, ...]


@checks_types
def fit_axis(scans_of_board: Sequence[RangeScan], turns_deg: Sequence[float]) -> AxisFit:
    """Find the axis from scans of a flat board of markers.

    The turntable rotated the board; its angles are given. The board has ArUco markers of the dictionary 4×4; each scan
    is one capture with colour. `examples/turntable.py` finds an axis and merges views about it.
    Returns the `axis`, the residual `rms_mm` and the angle of each view as the markers have it, `rotation_deg`. Raises
    BadInput when a scan shows no such board, the views have too few markers in common, rotate too little, or by other
    angles than stated.
    """
    if len(scans_of_board) != len(turns_deg):
        raise BadInput(f"{len(scans_of_board)} views and {len(turns_deg)} angles", "give one angle for each view")
    return axis_of_corners([board_corners(scan) for scan in scans_of_board], turns_deg)


def axis_of_corners(views: Sequence[Mapping[int, Floats]], turns_deg: Sequence[float]) -> AxisFit:
    """Find the axis from the corners of markers in two or more views.

    views: for each view, marker → its corners (4, 3) mm in the scanner's frame.
    turns_deg: the angles of the turntable.
    Raises BadInput when the views have too few markers in common, rotate too little, or by other angles than stated.
    """
    if not len(views) or len(views) != len(turns_deg):
        raise BadInput(f"{len(views)} views and {len(turns_deg)} angles", "give one angle for each view")
    first, turns = views[0], np.asarray(turns_deg, float) - turns_deg[0]
    pairs = [_shared_corners(first, view) for view in views[1:]]
    if not pairs or np.abs(np.sin(np.radians(turns))).max() < np.sin(np.radians(MIN_TURN_DEG)):
        raise BadInput(
            "the views do not say where the axis is and which way it turns",
            "turn the board between them by something else than half a turn: three views or more do",
        )
    rotations, shifts = zip(*(_rigid(before, after) for before, after in pairs), strict=True)
    initial = _initial_guess(np.array(rotations), np.array(shifts), turns[1:], np.concatenate([p[0] for p in pairs]))

    def off(parameters: Floats) -> Floats:
        return np.concatenate(
            [
                (
                    _transform(_rotation_about(parameters[:3], np.radians(turn) * _unit(parameters[3:])), before)
                    - after
                ).ravel()
                for turn, (before, after) in zip(turns[1:], pairs, strict=True)
            ]
        )

    solution = least_squares(off, initial, x_scale=np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3]))
    direction = _unit(solution.x[3:])
    middle = np.concatenate([p[0] for p in pairs]).mean(axis=0)
    point = solution.x[:3] + direction * (
        (middle - solution.x[:3]) @ direction
    )  # the point of the axis nearest to the corners
    turned = (0.0, *(_angle(rotation, direction) for rotation in rotations))
    _check_turns(turned, turns)
    return AxisFit(RotationAxis(point, direction), float(np.sqrt(np.mean(solution.fun**2) * 3)), turned)


def _shared_corners(first: Mapping[int, Floats], other: Mapping[int, Floats]) -> tuple[Floats, Floats]:
    markers = sorted(first.keys() & other.keys())
    if 4 * len(markers) < MIN_CORNERS:
        raise BadInput(
            f"two views have {len(markers)} markers of the board in common",
            "put the board where every view sees most of it, and light it evenly",
        )
    before, after = (np.concatenate([view[marker] for marker in markers]) for view in (first, other))
    return before, after


def _rigid(before: Floats, after: Floats) -> tuple[Floats, Floats]:
    """Return rotation (3, 3) and shift (3,) between points (n, 3) (Kabsch)."""
    rotation, _ = Rotation.align_vectors(after - after.mean(axis=0), before - before.mean(axis=0))
    matrix = rotation.as_matrix()
    return matrix, after.mean(axis=0) - matrix @ before.mean(axis=0)


def _initial_guess(rotations: Floats, shifts: Floats, turns: Floats, corners: Floats) -> Floats:
    """Return point and direction (6,) of the fixed line of all motions, least squares."""
    deviation = rotations - np.eye(3)
    direction = np.linalg.eigh(np.einsum("kji,kjl->il", deviation, deviation))[1][:, 0]
    if np.sin(np.radians(turns)) @ [np.sin(np.radians(_angle(r, direction))) for r in rotations] < 0:
        direction = -direction
    middle = corners.mean(axis=0)  # the origin of the point: along the axis it is not determined
    system = np.concatenate([-deviation.reshape(-1, 3), direction[None]])
    right_side = np.append((shifts + deviation @ middle).ravel(), 0.0)
    return np.concatenate([middle + np.linalg.lstsq(system, right_side, rcond=None)[0], direction])


def _check_turns(turned: Sequence[float], stated: Floats) -> None:
    off = _wrap(np.asarray(turned) - stated)
    worst = int(np.argmax(np.abs(off)))
    if abs(off[worst]) > MAX_TURN_ERROR_DEG:
        raise BadInput(
            f"the stage turned the board by {turned[worst] % 360:.2f}° when it was set to {stated[worst] % 360:.2f}°",
            "check `model` and `relative` in [turntable], and that nothing slips",
        )


def _angle(rotation: Floats, direction: Floats) -> float:
    """The component in degrees of a rotation (3, 3) about a direction (3,)."""
    return float(np.degrees(Rotation.from_matrix(rotation).as_rotvec() @ direction))


def _rotation_about(point: Floats, turn: Floats) -> Floats:
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    motion[:3, 3] = point - motion[:3, :3] @ point
    return motion


def _transform(motion: Floats, points: Floats) -> Floats:
    return np.asarray(points @ motion[:3, :3].T + motion[:3, 3])


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))


def _wrap(degrees: Floats) -> Floats:
    return np.asarray((degrees + 180.0) % 360.0 - 180.0)
