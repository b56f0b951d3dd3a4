import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from restore.mesh.adjacency import sides_of
from restore.mesh.topology import Topology

FACES = st.lists(st.tuples(*[st.integers(0, 8)] * 3).filter(lambda face: len(set(face)) == 3), min_size=1, max_size=12)


@given(FACES)
def test_tables_agree_with_counting_by_hand(faces):
    topology = Topology(np.array(faces))
    counts: dict[tuple[int, int], int] = {}
    for face in faces:
        for k in range(3):
            edge = tuple(sorted((face[k], face[(k + 1) % 3])))
            counts[edge] = counts.get(edge, 0) + 1
    assert [tuple(edge) for edge in topology.edges.tolist()] == sorted(counts)
    assert topology.face_counts.tolist() == [counts[edge] for edge in sorted(counts)]
    assert topology.border.tolist() == sorted({end for edge, count in counts.items() if count == 1 for end in edge})
    inside = {v for face in faces for v in face} - {v for edge, count in counts.items() if count != 2 for v in edge}
    assert np.flatnonzero(topology.inner).tolist() == sorted(inside)


def test_a_table_is_made_once():
    topology = Topology(np.array([[0, 1, 2], [0, 2, 3]]))
    assert topology.sides is topology.sides
    for mine, computed in zip(topology.sides, sides_of(topology.faces), strict=True):
        np.testing.assert_array_equal(mine, computed)


def test_faces_that_share_a_vertex_are_of_one_piece():
    assert Topology(np.array([[0, 1, 2], [3, 4, 5], [2, 6, 7]])).pieces.tolist() == [0, 1, 0]


def test_a_ring_is_not_a_disc_and_a_strip_of_it_is_one():
    ring = np.array([[[i, (i + 1) % 4, 4 + i], [(i + 1) % 4, 4 + (i + 1) % 4, 4 + i]] for i in range(4)]).reshape(-1, 3)
    assert not Topology(ring).is_disc
    assert Topology(ring[:-2]).is_disc
