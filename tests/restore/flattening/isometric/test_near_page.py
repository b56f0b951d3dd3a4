"""Pages near their start, in one piece and in several."""

import numpy as np
import pytest

from restore.flattening.isometric.page import least_absolute_page
from restore.mesh.network import make_network
from restore.mesh.ordered_grid import grid_faces
from restore.mesh.topology import Topology

SIDE = 40  # vertices
SPACING_MM = 4.0
NOISE = 0.01  # of the lengths
SCRAP_MM = 1.0


@pytest.mark.parametrize("seed", range(4))
def test_a_scrap_next_to_a_page_stays_next_to_it(seed):
    """Nothing tells where it lies: it is unfolded, which moves it by about its own size."""
    random = np.random.default_rng(seed)
    across, down = np.meshgrid(np.arange(SIDE), np.arange(SIDE, 0, -1))
    page = SPACING_MM * np.stack([across, down], axis=-1).reshape(-1, 2)
    scrap = SCRAP_MM * np.array([[0.0, 0.0], [1.0, 0.0], [0.9, 1.0]]) + [200.0, 50.0]
    faces = np.concatenate([grid_faces(np.ones((SIDE, SIDE), bool)), len(page) + np.array([[0, 1, 2]])])
    flat = np.concatenate([page, scrap])
    network = make_network(np.column_stack([flat, np.zeros(len(flat))]), Topology(faces))
    lengths = network.lengths * (1.0 + random.normal(0.0, NOISE, len(network.lengths)))
    folded = flat.copy()
    folded[-2] = folded[-3] + [0.05, 0.01]
    found = least_absolute_page(folded, make_network(np.empty((0, 3)), Topology(faces), lengths))
    assert np.abs(found.flat[-3:] - folded[-3:]).max() < 2.0 * SCRAP_MM
    sides = np.linalg.norm(found.flat[-3:] - np.roll(found.flat[-3:], 1, axis=0), axis=1)
    true = np.linalg.norm(scrap - np.roll(scrap, 1, axis=0), axis=1)
    np.testing.assert_allclose(sides, true, rtol=5 * NOISE)
