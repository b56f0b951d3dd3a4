"""The mass-spring baseline: what it reaches on exact sheets, and its law of motion (Brown & Seales, TPAMI 2004)."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated.scene.sheets import Curl, Flat, MultiFold, Spread, Wave
from oracles.exact import ExactSheet, exact_sheet
from oracles.markers import rigid_residual
from restore.errors import BadInput
from restore.flattening.published import springs as module
from restore.flattening.published.hinges import hinges_of
from restore.flattening.published.springs import advance, flatten_springs, springs
from restore.mesh.measures import edge_strain, flipped_faces, signed_areas

POINTS = 1000
NEAR_MM = 0.02  # rms; the springs still swing a little when the area has stopped changing: 0.0002 to 0.005 mm measured
REST_STRAIN = 1e-3  # rms, for the same reason; 2e-5 to 1e-4 measured
EXACT_MM = 1e-6  # a flat sheet is not moved: rounding alone
ROUNDING = 1e-12
A_MILLIMETRE = 1.0
SHEETS = {
    "curl up": Curl(),
    "curl down": Curl(radius_mm=-170.0),
    "fold": MultiFold(),
    "wave": Wave(),
    "gutter": Spread(),
}


@pytest.mark.parametrize("name", SHEETS)
def test_comes_to_rest_unstretched_near_the_truth(name):
    sheet = exact_sheet(SHEETS[name], POINTS)
    network = sheet.network()
    flat, steps, *_ = flatten_springs(sheet.posed(), network)
    assert steps < module.MAX_STEPS
    assert rms_mm(flat, sheet) < NEAR_MM
    assert flipped_faces(flat, network.faces) == 0
    assert np.sqrt(np.mean(edge_strain(flat, network.edges, network.lengths) ** 2)) < REST_STRAIN


def test_the_page_is_not_mirrored():
    sheet = exact_sheet(Curl(), POINTS)
    flat, *_ = flatten_springs(sheet.posed(), sheet.network())
    assert (signed_areas(flat, sheet.mesh.faces) > 0).all()
    assert rms_mm(flat * [-1, 1], sheet) > A_MILLIMETRE  # the measure would see it


def test_a_flat_sheet_stays():
    sheet = exact_sheet(Flat(), POINTS)
    flat, steps, *_ = flatten_springs(sheet.posed(), sheet.network())
    assert steps == module.QUIET_STEPS + 1  # the first step has nothing to compare with
    assert rms_mm(flat, sheet) < EXACT_MM


def test_a_step_too_long_is_reported(monkeypatch):
    monkeypatch.setattr(module, "TIME_STEP", 3 * module.TIME_STEP)
    sheet = exact_sheet(Curl(), POINTS)
    with pytest.raises(BadInput, match="diverge"):
        flatten_springs(sheet.posed(), sheet.network())


def test_springs_over_hinges_keep_a_roll_from_folding_over():
    sheet = exact_sheet(Curl(radius_mm=100.0, taper=0.0), POINTS)
    network = sheet.network()
    pages = (flatten_springs(sheet.posed(), network, bending=bending) for bending in (True, False))
    kept, folded = (flipped_faces(page.flat, network.faces) for page in pages)
    assert kept == 0 < folded


def test_every_step_can_be_followed():
    sheet, seen = exact_sheet(MultiFold(), POINTS), []
    posed = sheet.posed()
    flat, steps, *_ = flatten_springs(posed, sheet.network(), lambda step, positions: seen.append((step, positions)))
    assert [step for step, _ in seen] == list(range(1, steps + 1))
    assert np.abs(seen[0][1] - posed.positions).max() < A_MILLIMETRE < np.abs(seen[-1][1] - posed.positions).max()
    np.testing.assert_array_equal(seen[-1][1][:, :2], flat)


def test_compiled_and_plain_springs_agree():
    sheet = exact_sheet(Wave(), 100)
    network = sheet.network()
    rng = np.random.default_rng(3)
    velocity = rng.normal(size=sheet.mesh.vertices.shape)
    forces = [np.full_like(velocity, np.nan) for _ in range(2)]
    stretched = 1.1 * sheet.mesh.vertices
    for run, force in zip((springs, springs.py_func), forces, strict=True):
        run(stretched, velocity, force, network.edges, network.lengths, *hinges_of(network), 100.0, 3.0, 0.5)
    np.testing.assert_allclose(*forces, rtol=0, atol=ROUNDING * np.abs(forces[0]).max() * len(velocity))


def test_springs_pull_by_hooke_and_damp_along_themselves_alone():
    now = np.array([[0.0, 0, 0], [3.0, 0, 0]])
    velocity = np.array([[0.0, 0, 0], [0.5, 7.0, -2.0]])
    force = np.empty_like(now)
    pair, none, nothing = np.array([[0, 1]]), np.empty((0, 2), np.int64), np.empty(0)
    springs(now, velocity, force, pair, np.array([2.0]), none, nothing, 10.0, 4.0, 1.0)
    pull = 10.0 * (3.0 - 2.0) + 4.0 * 0.5
    np.testing.assert_allclose(force, [[pull, 0, 0], [-pull, 0, 0]], rtol=ROUNDING)


def test_the_table_takes_the_normal_velocity_and_leaves_the_tangential():
    now, velocity = np.array([[0.0, 0, 0.1]]), np.array([[2.0, -1.0, -5.0]])
    advance(now, velocity, np.zeros((1, 3)), 0.0, 0.0, 0.1)
    np.testing.assert_allclose(now, [[0.2, -0.1, 0.0]], atol=ROUNDING)
    np.testing.assert_allclose(velocity, [[2.0, -1.0, 0.0]], rtol=ROUNDING)


def rms_mm(flat, sheet: ExactSheet) -> float:
    return float(np.sqrt((rigid_residual(flat, sheet.flat)[0] ** 2).sum(axis=1).mean()))
