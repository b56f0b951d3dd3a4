"""Lists of numbers behind their lengths."""

import numpy as np
import pytest

from restore.formats.parsing.records import find_lists, gather

LISTS = ([5, 6, 7], [], [9])


def encoded(order, length_kind):
    """Records of one byte, then a list of int32."""
    lengths = [np.array(len(one), order + length_kind).tobytes() for one in LISTS]
    bodies = [np.array(one, order + "i4").tobytes() for one in LISTS]
    return b"".join(b"\1" + length + body for length, body in zip(lengths, bodies, strict=True))


def find(data, width, *, big):
    starts, counts = (np.full((1, len(LISTS)), -1, np.int32) for _ in range(2))
    end = find_lists(np.frombuffer(data, np.uint8), 0, np.array([0, width]), np.array([1, 4]), big, starts, counts)
    return end, starts[0], counts[0]


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize(("kind", "width"), [("u1", 1), ("u2", 2), ("u4", 4)])
def test_lists_come_back_in_every_order_of_bytes(order, kind, width):
    data = encoded(order, kind)
    end, starts, counts = find(data, width, big=order == ">")
    assert end == len(data)
    assert counts.tolist() == [3, 0, 1]
    values = np.empty(4 * counts.sum(), np.uint8)
    gather(np.frombuffer(data, np.uint8), starts, counts, 4, values)
    assert values.view(order + "i4").tolist() == [5, 6, 7, 9]


def test_a_file_that_ends_early_has_no_end_at_any_place():
    data = encoded("<", "u2")
    assert [find(data[:size], 2, big=False)[0] for size in range(len(data))] == [-1] * len(data)


def test_the_length_that_the_file_is_too_short_for_is_reported():
    end, _, counts = find(b"\1" + (2**32 - 1).to_bytes(4, "little") + bytes(8), 4, big=False)
    assert end == -1
    assert counts[0] == 2**31 - 1


@pytest.mark.parametrize("length", [np.nan, -1.0, 1.5, 1e300, np.inf])
def test_a_length_of_a_text_that_is_not_a_whole_number_is_refused(length):
    data = np.array([length, 1.0, 2.0]).tobytes()
    starts, counts = (np.zeros((1, 1), np.int32) for _ in range(2))
    assert find_lists(np.frombuffer(data, np.uint8), 0, np.array([8]), np.array([8]), False, starts, counts) == -1
