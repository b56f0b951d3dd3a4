"""The default method: wrong signs of faces and a tangled start do not keep it from the true page."""

import numpy as np
import pytest

from restore.flattening import isometric
from restore.flattening.isometric import flatten_isometric
from restore.mesh.network import make_network
from restore.mesh.pose import pose_on_table

TRUE_MM = 0.01
WRONG = 0.02  # of the signs


def solved(page, **changes):
    network = make_network(page.mesh.vertices, page.mesh.faces, page.lengths)
    return flatten_isometric(pose_on_table(page.mesh.vertices, page.mesh.faces), network, **changes)


@pytest.mark.parametrize("shape", ["curl", "oblique wave", "gutter", "fold"])
def test_wrong_signs_are_found_out(warped, shape, monkeypatch, rng):
    page = warped(shape, count=500)
    signs = np.where(rng.random(len(page.mesh.faces)) < WRONG, -1.0, 1.0)
    assert (signs < 0).any()
    monkeypatch.setattr(isometric, "face_signs", lambda *_: signs)
    assert page.error(solved(page).flat) < TRUE_MM


def test_a_tangled_start_is_replaced_by_a_conformal_one(warped, monkeypatch, rng):
    page = warped("curl", count=500)
    tangled = rng.normal(0, 100, page.flat.shape)
    monkeypatch.setattr(isometric, "flat_from_lengths", lambda *_: tangled)
    assert page.error(solved(page).flat) < TRUE_MM


def test_the_start_and_the_result_are_followed(warped):
    page, seen = warped("curl", count=200), []
    found = solved(page, follow=lambda step, positions: seen.append((step, positions)))
    assert [step for step, _ in seen] == [1, 2]
    np.testing.assert_array_equal(seen[-1][1][:, :2], found.flat)
