"""Tables by counting hold what sorting would."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from restore.flatten.adjacency import adjacency, order_of_pairs

PAIRS = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), max_size=60)


def test_rows_of_the_table_hold_what_was_grouped():
    table = adjacency(np.array([2, 0, 2, 2]), np.array([7, 8, 9, 4]), 4)
    rows = [set(table.items[a:b]) for a, b in zip(table.start[:-1], table.start[1:], strict=True)]
    assert rows == [{8}, set(), {7, 9, 4}, set()]


@given(PAIRS)
def test_pairs_ascend_and_equal_ones_stay_as_they_are(pairs):
    first, second = np.array(pairs, np.int64).reshape(-1, 2).T
    order = order_of_pairs(first, second, 10)
    np.testing.assert_array_equal(order, np.lexsort((second, first)))


@given(PAIRS)
def test_compiled_and_plain_python_agree(pairs):
    first, second = np.array(pairs, np.int64).reshape(-1, 2).T
    for one, other in zip(adjacency(first, second, 10), adjacency.py_func(first, second, 10), strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(order_of_pairs(first, second, 10), order_of_pairs.py_func(first, second, 10))
