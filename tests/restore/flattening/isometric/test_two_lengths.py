"""Which lengths a page follows: those along the surface where they agree, any between both where they do not."""

import numpy as np
import pytest

from restore.flattening.isometric.two_lengths import with_surface_lengths
from restore.flattening.methods import flatten_with_lengths
from restore.mesh.measures import straight_lengths
from restore.mesh.validate import validated

TRUE_MM = 0.01  # exact lengths from a page within a millimetre; robust steps end within a ten-thousandth of an edge
ROUNDING = 1e-9


@pytest.fixture
def straight(warped):
    """A warped page with its mesh, and the page that follows its straight lengths."""
    page = warped("curl", count=400)
    mesh = validated(page.mesh)
    return page, mesh, flatten_with_lengths(mesh, straight_lengths(mesh.vertices, mesh.topology.edges))


def test_lengths_that_agree_are_followed(straight):
    page, mesh, flat = straight
    found = with_surface_lengths(flat, mesh, page.lengths)
    assert page.error(found.flat) < TRUE_MM < page.error(flat.flat)
    np.testing.assert_array_equal(found.lengths, page.lengths)


def test_lengths_that_contradict_each_other_move_the_page_little(straight, rng):
    page, mesh, flat = straight
    found = with_surface_lengths(flat, mesh, page.lengths * rng.uniform(1, 2, len(page.lengths)))
    assert page.error(found.flat) < 2 * page.error(flat.flat)
    shorter = straight_lengths(mesh.vertices, mesh.topology.edges)
    assert (found.lengths >= shorter - ROUNDING).all()
    assert (found.lengths <= 2 * page.lengths + ROUNDING).all()


def test_rest_lengths_between_both_are_those_of_the_page_where_it_lies_between(straight, rng):
    page, mesh, flat = straight
    longer = page.lengths * rng.uniform(1, 2, len(page.lengths))
    found = with_surface_lengths(flat, mesh, longer)
    edges = mesh.topology.edges
    on_page = np.linalg.norm(found.flat[edges[:, 0]] - found.flat[edges[:, 1]], axis=1)
    inside = (on_page > flat.lengths) & (on_page < longer)
    assert inside.any()
    np.testing.assert_allclose(found.lengths[inside], on_page[inside], rtol=ROUNDING)
