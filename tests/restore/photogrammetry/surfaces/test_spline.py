"""What splines add to normal equations is the gradient and the curvature of the energies they are said to have."""

import numpy as np
import pytest

from restore.photogrammetry.surfaces.spline import (
    TINY_WEIGHT,
    add_bending,
    add_points,
    add_strain,
    evaluate,
    numbering,
    solve,
)

ROWS, COLS, STEP = 6, 9, 4.0
LOW = np.array([-4.0, -4.0])
DELTA = 1e-5  # of coefficients of some millimetres: central differences are then exact to about DELTA²
ROUNDING = 1e-6  # relative, of such differences in double precision


@pytest.fixture(params=[(ROWS, COLS), (COLS, ROWS)], ids=["wide", "tall"])
def sheet(request):
    """Coefficients of a sheet that is nearly a plane, with a curl and some noise."""
    rows, cols = request.param
    row, col = np.mgrid[:rows, :cols]
    plane = np.stack((STEP * (col - 1.0), STEP * (row - 1.0), 0.3 * (col - 3.0) ** 2), axis=2)
    return plane + np.random.default_rng(5).normal(0.0, 0.1, plane.shape)


def places(sheet, count=40):
    rows, cols, _ = sheet.shape
    share = np.random.default_rng(6).random((count, 2))
    return LOW + STEP + share * STEP * (np.array([cols, rows]) - 3.0)


def assembled(sheet, add):
    """The full matrix and right side, in the order of the coefficients as they stand."""
    rows, cols, _ = sheet.shape
    by_row, by_col, width = numbering(rows, cols)
    band, side = np.zeros((sheet.size, width)), np.zeros(sheet.size)
    add(band, side, by_row, by_col)
    matrix = np.zeros((sheet.size, sheet.size))
    for j in range(sheet.size):
        below = min(width, sheet.size - j)
        matrix[j : j + below, j] = matrix[j, j : j + below] = band[j, :below]
    row, col, d = np.indices(sheet.shape)
    order = (3 * (row * by_row + col * by_col) + d).ravel()
    return matrix[np.ix_(order, order)], side[order]


def slope(energy, sheet, way):
    return (energy(sheet + DELTA * way) - energy(sheet - DELTA * way)) / (2 * DELTA)


def test_derivatives_are_those_of_the_values(sheet):
    at = places(sheet)
    value, du, dv, duu, duv, dvv = np.moveaxis(evaluate(at, LOW, STEP, sheet, 2), 1, 0)
    np.testing.assert_array_equal(value, evaluate(at, LOW, STEP, sheet, 0)[:, 0])
    for axis, derivative, second in ((0, du, (duu, duv)), (1, dv, (duv, dvv))):
        step = DELTA * np.eye(2)[axis]
        after, before = (evaluate(at + sign * step, LOW, STEP, sheet, 1) for sign in (1, -1))
        change = (after - before) / (2 * DELTA)
        np.testing.assert_allclose(derivative, change[:, 0], atol=ROUNDING)
        for k in range(2):
            np.testing.assert_allclose(second[k], change[:, 1 + k], atol=ROUNDING)


def test_a_spline_whose_coefficients_are_linear_is_a_plane():
    row, col = np.mgrid[:ROWS, :COLS]
    flat = np.stack((STEP * col + LOW[0], STEP * row + LOW[1], 0.0 * row), axis=2)
    at = places(flat)
    np.testing.assert_allclose(evaluate(at, LOW, STEP, flat, 0)[:, 0, :2], at, atol=1e-12)


def test_points_pull_along_their_normals_and_a_little_across(sheet):
    rng = np.random.default_rng(7)
    at, sliding, weights = places(sheet), 0.2, rng.random(40)
    points = evaluate(at, LOW, STEP, sheet, 0)[:, 0] + rng.normal(0.0, 1.0, (40, 3))
    normals = rng.normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)

    def energy(coefficients):
        off = points - evaluate(at, LOW, STEP, coefficients, 0)[:, 0]
        along = (off * normals).sum(axis=1) ** 2
        return 0.5 * (weights * ((1 - sliding) * along + sliding * (off**2).sum(axis=1))).sum()

    matrix, side = assembled(
        sheet,
        lambda band, right, *by: add_points(band, right, at, points, normals, weights, sliding, LOW, STEP, sheet, *by),
    )
    way = rng.normal(size=sheet.shape)
    flat = way.ravel()
    expected = energy(sheet) - side @ flat + 0.5 * flat @ matrix @ flat
    assert energy(sheet + way) == pytest.approx(expected, rel=ROUNDING)


def test_strain_resists_by_its_gradient(sheet):
    stiffness, most = 3.0, 0.05
    by_row = np.arange(sheet.shape[0] - 3)[:, None] + 1.5
    middles = np.stack(np.broadcast_arrays(np.arange(sheet.shape[1] - 3) + 1.5, by_row), axis=2).reshape(-1, 2)

    def energy(coefficients):
        _, su, sv = np.moveaxis(evaluate(LOW + STEP * middles, LOW, STEP, coefficients, 1), 1, 0)
        first, second, shear = ((a * b).sum(axis=1) for a, b in ((su, su), (sv, sv), (su, sv)))
        squared = (first - 1) ** 2 / 4 + (second - 1) ** 2 / 4 + shear**2 / 2
        return 0.5 * stiffness * most**2 * np.log1p(squared / most**2).sum()

    matrix, side = assembled(sheet, lambda band, right, *by: add_strain(band, right, sheet, STEP, stiffness, most, *by))
    way = np.random.default_rng(8).normal(size=sheet.shape)
    assert -side @ way.ravel() == pytest.approx(slope(energy, sheet, way), rel=ROUNDING)
    assert np.linalg.eigvalsh(matrix)[0] > -ROUNDING  # a sum of squares


def test_a_constant_curvature_is_not_resisted_and_its_change_is(sheet):
    rows, cols, _ = sheet.shape
    row, col = np.mgrid[:rows, :cols]
    curled = np.stack((col, row, col**2 - 2.0 * col * row + 3.0 * row**2), axis=2).astype(float)
    _, side = assembled(curled, lambda band, right, *by: add_bending(band, right, curled, 2.0, 1.0, *by))
    np.testing.assert_allclose(side, 0.0, atol=1e-9)
    matrix, side = assembled(sheet, lambda band, right, *by: add_bending(band, right, sheet, 2.0, 1.0, *by))
    np.testing.assert_allclose(side, -(matrix - TINY_WEIGHT * np.eye(len(matrix))) @ sheet.ravel(), atol=1e-9)
    assert np.abs(side).max() > 0.1


def test_a_ruled_sheet_goes_on_changing_its_curvature_across_the_rulings(sheet):
    rows, cols, _ = sheet.shape
    row, col = np.mgrid[:rows, :cols].astype(float)

    def resisted(bent, along):
        curled = np.stack((col, row, bent), axis=2)
        by_row, by_col, width = numbering(rows, cols, along_rows=True)
        band, side = np.zeros((3 * rows * cols, width)), np.zeros(3 * rows * cols)
        add_bending(band, side, curled, 2.0, along, by_row, by_col)
        return np.abs(side).max()

    assert resisted(col**3, 1.0) > 1
    assert resisted(col**3, 1e3) < 1e-6  # exact but for rounding
    assert resisted(col**4, 1e3) > 1
    assert resisted(row**3, 1e3) == pytest.approx(1e3 * resisted(row**3, 1.0))


@pytest.mark.parametrize(("count", "width"), [(60, 7), (61, 4), (63, 2), (5, 12), (62, 30)])
def test_a_band_is_solved_as_its_matrix_is(count, width):
    rng = np.random.default_rng(9)
    lower = np.tril(np.triu(rng.normal(size=(count, count)), -width + 1)) + 4 * np.eye(count)
    matrix, side = lower @ lower.T, rng.normal(size=count)
    band = np.array([[matrix[j + k, j] if j + k < count else 0.0 for k in range(width)] for j in range(count)])
    expected = np.linalg.solve(matrix, side)
    solve(band, side)
    np.testing.assert_allclose(side, expected, rtol=1e-9)


def test_a_pivot_that_rounding_took_divides_by_nothing():
    """Beside resistances of 1e7 and more the TINY_WEIGHT of what nothing determines may be lost in their rounding."""
    band, side = np.array([[1.0, 1.0], [1.0, 0.0], [1.0, 0.0]]), np.array([1.0, 1.0, 2.0])
    solve(band, side)  # of [[1, 1, 0], [1, 1, 0], [0, 0, 1]]
    assert np.isfinite(side).all()
    assert side[:2].sum() == pytest.approx(1.0, abs=ROUNDING)
    assert side[2] == pytest.approx(2.0)
