"""Brown's lens, compiled: derivatives are those of the projection, and it is that of a camera."""

import numpy as np
from scipy.spatial.transform import Rotation

from oracles.table_cameras import cameras
from restore.camera.brown import differentiate, seen_at

ROUNDING = 1e-5  # of central differences over 1e-6
STEP = 1e-6
POINT = np.array([20.0, -15.0, 4.0])
LENS = np.array([-0.1, 0.05, 1e-3, -2e-3, 0.01])
CAMERA = cameras(2)[1]
VECTOR = np.concatenate([CAMERA.vector[:9], LENS])


def seen(turned=(0.0, 0.0, 0.0), changed=0.0, moved=0.0):
    turn = Rotation.from_rotvec(turned).as_matrix() @ CAMERA.rotation
    return np.array(seen_at(turn, VECTOR + changed, *(POINT + moved)))


def central(name, unit):
    return (seen(**{name: unit}) - seen(**{name: -unit})) / 2 / STEP


def test_derivatives_are_those_of_the_projection():
    by_camera, by_point = np.zeros((2, 14)), np.zeros((2, 3))
    differentiate(CAMERA.rotation, VECTOR, POINT, by_camera, by_point)
    for k in range(3):
        unit = np.eye(3)[k] * STEP
        np.testing.assert_allclose(by_camera[:, k], central("turned", unit), atol=ROUNDING)
        np.testing.assert_allclose(by_point[:, k], central("moved", unit), atol=ROUNDING)
    for k in range(3, 14):
        expected = central("changed", np.eye(14)[k] * STEP)
        np.testing.assert_allclose(by_camera[:, k], expected, rtol=ROUNDING, atol=ROUNDING)


def test_compiled_and_plain_python_agree():
    compiled, plain = (np.zeros((2, 14)), np.zeros((2, 3))), (np.zeros((2, 14)), np.zeros((2, 3)))
    differentiate(CAMERA.rotation, VECTOR, POINT, *compiled)
    differentiate.py_func(CAMERA.rotation, VECTOR, POINT, *plain)
    for one, other in zip(compiled, plain, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)
