"""Adjacency tables by counting agree with those by sorting."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from restore.mesh.adjacency import (
    _group,
    _join,
    adjacency,
    components,
    faces_around,
    inner_vertices,
    neighbours_of,
    order_of_pairs,
    sides_of,
)
from restore.mesh.topology import Topology

FACES = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9), st.integers(0, 9)), min_size=1, max_size=20)
PAIRS = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), max_size=60)


def rows_of(table):
    return [table.items[a:b].tolist() for a, b in zip(table.start[:-1], table.start[1:], strict=True)]


def test_rows_of_the_adjacency_table_hold_the_grouped_items():
    table = adjacency(np.array([2, 0, 2, 2]), np.array([7, 8, 9, 4]), 4)
    assert rows_of(table) == [[8], [], [7, 9, 4], []]


@given(PAIRS)
def test_items_keep_their_order_within_a_row(pairs):
    rows, items = np.array(pairs, np.int64).reshape(-1, 2).T
    wanted = [[item for row, item in pairs if row == i] for i in range(10)]
    assert rows_of(adjacency(rows, items, 10)) == wanted


@given(PAIRS)
def test_neighbours_are_those_that_an_edge_leads_to_in_the_order_of_edges(pairs):
    wanted = [[] for _ in range(10)]
    for a, b in pairs:
        wanted[a].append(b)
        wanted[b].append(a)
    assert rows_of(neighbours_of(np.array(pairs, np.int64).reshape(-1, 2), 10)) == wanted


@given(FACES)
def test_faces_around_a_vertex_are_those_with_a_corner_there(faces):
    wanted = [[f for f, corners in enumerate(faces) for corner in corners if corner == i] for i in range(10)]
    assert rows_of(faces_around(np.array(faces, np.int64), 10)) == wanted


@given(PAIRS)
def test_pairs_are_sorted_stably(pairs):
    first, second = np.array(pairs, np.int64).reshape(-1, 2).T
    order = order_of_pairs(first, second, 10)
    np.testing.assert_array_equal(order, np.lexsort((second, first)))


@given(PAIRS)
def test_compiled_and_plain_python_agree(pairs):
    pairs = np.array(pairs, np.int64).reshape(-1, 2)
    rows, items = pairs.T.copy()
    starts = np.searchsorted(np.sort(rows), np.arange(10))
    compiled, plain = (np.empty_like(items) for _ in range(2))
    _group(rows, items, starts.copy(), compiled)
    _group.py_func(rows, items, starts.copy(), plain)
    np.testing.assert_array_equal(compiled, plain)
    compiled, plain = np.arange(10), np.arange(10)
    _join(pairs, compiled)
    _join.py_func(pairs, plain)
    np.testing.assert_array_equal(compiled, plain)


@given(FACES)
def test_sides_are_grouped_by_edge(faces):
    faces = np.array(faces, np.int64)
    sides = sides_of(faces)
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    whole = ends[:, 0] != ends[:, 1]
    edges, index = np.unique(ends[whole], axis=0, return_inverse=True)
    np.testing.assert_array_equal(sides.edges, edges.reshape(-1, 2))
    np.testing.assert_array_equal(sides.edge[whole], index.ravel())
    assert (sides.edge[~whole] == -1).all()
    np.testing.assert_array_equal(np.sort(sides.at), np.flatnonzero(whole))
    np.testing.assert_array_equal(sides.edge[sides.at], np.repeat(np.arange(len(edges)), np.diff(sides.first)))
    assert all((np.diff(sides.at[a:b]) > 0).all() for a, b in zip(sides.first[:-1], sides.first[1:], strict=True))


@given(PAIRS)
def test_components_are_numbered_by_their_first_node(pairs):
    pairs = np.array(pairs, np.int64).reshape(-1, 2)
    _, label = connected_components(coo_matrix((np.ones(len(pairs)), pairs.T), shape=(10, 10)), directed=False)
    np.testing.assert_array_equal(components(pairs, 10), label)


def test_the_border_is_where_edges_have_one_face():
    fan = np.array([[0, 1 + k, 1 + (k + 1) % 6] for k in range(6)])
    np.testing.assert_array_equal(Topology(fan).border, [1, 2, 3, 4, 5, 6])
    np.testing.assert_array_equal(Topology(fan[:5]).border, np.arange(7))


@given(FACES)
def test_inner_vertices_have_edges_of_two_faces_alone(faces):
    sides = sides_of(np.array(faces, np.int64))
    counts = np.diff(sides.first)
    expected = [(at := (sides.edges == i).any(axis=1)).any() and (counts[at] == 2).all() for i in range(10)]
    np.testing.assert_array_equal(inner_vertices(sides, 10), expected)
