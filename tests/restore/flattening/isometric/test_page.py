"""The default method: wrong signs of faces and a tangled start do not keep it from the true page."""

import numpy as np
import pytest

from oracles.overlaps import overlapping_pairs
from oracles.warped import Warped
from restore import SurfaceMesh, flatten
from restore.flattening.isometric import page as isometric
from restore.flattening.isometric.page import flatten_isometric
from restore.mesh.measures import face_signs, signed_areas, straight_lengths
from restore.mesh.network import make_network
from restore.mesh.pose import pose_on_table
from restore.mesh.topology import Topology

TRUE_MM = 0.01
WRONG = 0.02  # of the signs
ROUNDING = 1e-9


def solved(page, **changes):
    network = make_network(page.mesh.vertices, Topology(page.mesh.faces), page.lengths)
    return flatten_isometric(pose_on_table(page.mesh.vertices, page.mesh.faces), network, **changes)


@pytest.mark.parametrize("shape", ["curl", "oblique wave", "gutter", "fold"])
def test_wrong_signs_are_found_out(warped, shape, monkeypatch, rng):
    page = warped(shape, count=500)
    signs = np.where(rng.random(len(page.mesh.faces)) < WRONG, -1.0, 1.0)
    assert (signs < 0).any()
    monkeypatch.setattr(isometric, "face_signs", lambda *_: signs)
    assert page.error(solved(page).flat) < TRUE_MM


@pytest.mark.parametrize("seed", range(4))
def test_a_sheet_without_folds_comes_out_whole_however_its_normals_mislead(seed):
    """A tenth of them do; by those beside it a face at the border seems folded over, which would strain its page."""
    x, y = np.meshgrid(5.0 * np.arange(40.0) - 97.5, 5.0 * np.arange(28.0) - 67.5)
    flat = np.stack([x.ravel(), y.ravel()], axis=1)
    corner = (np.arange(27)[:, None] * 40 + np.arange(39)).ravel()
    faces = np.concatenate([corner[:, None] + [0, 1, 41], corner[:, None] + [0, 41, 40]])
    across, along = (flat + np.random.default_rng(seed).normal(0.0, 1.6, flat.shape)).T
    rough = np.stack([100.0 * np.sin(across / 100.0), along, 100.0 * np.cos(across / 100.0)], axis=1)
    page = Warped(SurfaceMesh(rough, faces), flat, straight_lengths(flat, Topology(faces).edges))
    assert (face_signs(rough, faces) < 0.0).mean() > 0.03
    assert page.error(solved(page).flat) < TRUE_MM


def test_a_flap_follows_its_neighbours_once_their_signs_are_right(warped, monkeypatch):
    """No fan tells of a third face on an edge, and its normal none among normals that mislead."""
    page = warped("curl", count=500)
    middle = int(np.argmin(np.linalg.norm(page.flat[page.mesh.faces].mean(axis=1), axis=1)))
    a, b, c = page.mesh.faces[middle]
    lift = 0.5 * (page.mesh.vertices[[a, b]].mean(axis=0) + page.mesh.vertices[c])
    flat = np.vstack([page.flat, 0.5 * (page.flat[[a, b]].mean(axis=0) + page.flat[c])])
    mesh = SurfaceMesh(np.vstack([page.mesh.vertices, lift]), np.vstack([page.mesh.faces, [b, a, len(page.flat)]]))
    torn = Warped(mesh, flat, straight_lengths(flat, Topology(mesh.faces).edges))
    true = np.sign(signed_areas(flat, mesh.faces))
    assert (true < 0).sum() == 1
    misled = np.where(np.isin(mesh.faces, [a, b]).any(axis=1), -true, true)
    monkeypatch.setattr(isometric, "face_signs", lambda *_: misled)
    assert torn.error(solved(torn).flat) < TRUE_MM


@pytest.mark.parametrize("shape", ["curl", "fold"])
def test_wrong_signs_that_no_fan_gives_away_for_noise_are_found_out(warped, shape, monkeypatch, rng):
    exact = warped(shape, count=500)
    page = Warped(exact.mesh, exact.flat, exact.lengths * np.exp(0.01 * rng.normal(size=len(exact.lengths))))
    by_true_signs = page.error(solved(page).flat)
    signs = np.where(rng.random(len(page.mesh.faces)) < WRONG, -1.0, 1.0)
    assert (signs < 0).any()
    monkeypatch.setattr(isometric, "face_signs", lambda *_: signs)
    monkeypatch.setattr(isometric, "_other_starts", lambda *_: iter([]))  # which do not always find it
    assert page.error(solved(page).flat) == pytest.approx(by_true_signs, rel=1e-3)


def test_a_tangled_start_is_replaced_by_a_conformal_one(warped, monkeypatch, rng):
    page = warped("curl", count=500)
    tangled = rng.normal(0, 100, page.flat.shape)
    monkeypatch.setattr(isometric, "flat_from_lengths", lambda *_: tangled)
    assert page.error(solved(page).flat) < TRUE_MM


@pytest.mark.parametrize("shape", ["curl", "gutter"])
def test_a_corner_that_starts_on_the_wrong_side_of_its_face_comes_back(warped, shape, monkeypatch):
    page = warped(shape, count=500)
    corner = int(np.flatnonzero(np.bincount(page.mesh.faces.ravel()) == 1)[0])  # of one face
    start = page.mirrored_at(corner)
    monkeypatch.setattr(isometric, "flat_from_lengths", lambda *_: start)
    monkeypatch.setattr(isometric, "_other_starts", lambda *_: iter([]))
    assert page.error(solved(page).flat) < TRUE_MM


def test_loose_triangles_keep_their_shape_and_lie_apart(rng):
    corners = rng.uniform(0, 100, (60, 1, 3)) + rng.normal(0, 5, (60, 3, 3))
    mesh = SurfaceMesh(corners.reshape(-1, 3), np.arange(180).reshape(-1, 3))
    page = flatten(mesh)
    for before, after in zip(page.vertices[page.faces], page.flat[page.faces], strict=True):
        np.testing.assert_allclose(sides(after), sides(before), rtol=ROUNDING)
    assert len(overlapping_pairs(page.flat, page.faces)) == 0


def sides(corners):
    return np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)


def test_the_start_and_the_result_are_followed(warped):
    page, seen = warped("curl", count=200), []
    found = solved(page, follow=lambda step, positions: seen.append((step, positions)))
    assert [step for step, _ in seen] == [1, 2]
    np.testing.assert_array_equal(seen[-1][1][:, :2], found.flat)
