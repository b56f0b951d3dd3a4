"""The compiled inner loops, against the same in plain Python and against the equations they stand for."""

import numpy as np
import pytest

from restore.flattening.published import stick_kernels as kernels
from restore.flattening.published.hinges import hinges_of
from restore.mesh.network import make_network
from restore.mesh.topology import Topology

PARITY = 1e-9  # mm: compiled sums may be taken in another order
EXACT = 1e-12


@pytest.fixture
def sheet(warped):
    page = warped("curl", count=60)
    now = page.mesh.vertices + [0.0, 0.0, 900.0]
    return now, now - 0.1, make_network(page.mesh.vertices, Topology(page.mesh.faces), page.lengths)


def advance(run, now, before, network):
    run(now, before, 9.81, 0.2, 0.95, 0.2)
    return now, before


def project(run, now, before, network):
    run(now, network.edges, network.lengths)
    return (now,)


def relax(run, now, before, network):
    run(now, network.edges, network.lengths, *hinges_of(network), 3)
    return (now,)


@pytest.mark.parametrize(
    "name, work",
    [
        ("advance", advance),
        ("_project", project),
        ("relax", relax),
    ],
)
def test_compiled_and_plain_python_agree(sheet, name, work):
    now, before, network = sheet
    kernel = getattr(kernels, name)
    compiled, plain = (work(run, now.copy(), before.copy(), network) for run in (kernel, kernel.py_func))
    for one, other in zip(compiled, plain, strict=True):
        np.testing.assert_allclose(one, other, atol=PARITY)
    assert np.abs(compiled[0] - now).max() > 0.01


def test_a_verlet_step_is_equation_5_with_the_drag_of_equation_4():
    now, before = np.array([[10.0, -20.0, 5.0]]), np.array([[9.0, -19.5, 6.0]])
    kernels.advance(now, before, 9.81, 0.05, 0.95, 0.1)
    np.testing.assert_array_equal(before, [[10.0, -20.0, 5.0]])
    velocity = 0.95 * np.array([1.0, -0.5, -1.0])
    force = np.array([0.05 * 10, 0.05 * -20, -9.81])
    np.testing.assert_allclose(now, [[10.0, -20.0, 5.0] + velocity + 0.01 * force], atol=EXACT)


def test_a_stick_moves_both_its_ends_by_half_of_the_error():
    """Equations 1 to 3; a stick 2 mm too long."""
    now = np.array([[0.0, 0.0, 5.0], [3.0, 4.0, 5.0]])
    kernels.relax(now, np.array([[0, 1]]), np.array([3.0]), np.empty((0, 2), int), np.empty(0), 1)
    np.testing.assert_allclose(now, [[0.6, 0.8, 5.0], [2.4, 3.2, 5.0]], atol=EXACT)


def test_nothing_sinks_below_the_table():
    now = np.array([[0.0, 0.0, -5.0], [3.0, 4.0, 7.0]])
    kernels.relax(now, np.empty((0, 2), int), np.empty(0), np.empty((0, 2), int), np.empty(0), 1)
    np.testing.assert_array_equal(now[:, 2], [0.0, 7.0])


def test_two_particles_at_one_place_do_no_harm():
    now = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0]])
    kernels.relax(now, np.array([[0, 1]]), np.array([3.0]), np.empty((0, 2), int), np.empty(0), 5)
    assert np.isfinite(now).all()
