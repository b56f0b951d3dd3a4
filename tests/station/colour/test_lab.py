"""CIELAB and CIEDE2000 against published values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.colour.lab import difference, lab_of_linear

# Sharma, Wu, Dalal (2005), table 1: pairs 1–4, 7, 9–12, 16, 17, 21, 25, 31, 34. They reach every branch of the formula.
PUBLISHED = [
    ((50.0000, 2.6772, -79.7751), (50.0000, 0.0000, -82.7485), 2.0425),
    ((50.0000, 3.1571, -77.2803), (50.0000, 0.0000, -82.7485), 2.8615),
    ((50.0000, 2.8361, -74.0200), (50.0000, 0.0000, -82.7485), 3.4412),
    ((50.0000, -1.3802, -84.2814), (50.0000, 0.0000, -82.7485), 1.0000),
    ((50.0000, 0.0000, 0.0000), (50.0000, -1.0000, 2.0000), 2.3669),
    ((50.0000, 2.4900, -0.0010), (50.0000, -2.4900, 0.0009), 7.1792),
    ((50.0000, 2.4900, -0.0010), (50.0000, -2.4900, 0.0010), 7.1792),
    ((50.0000, 2.4900, -0.0010), (50.0000, -2.4900, 0.0011), 7.2195),
    ((50.0000, 2.4900, -0.0010), (50.0000, -2.4900, 0.0012), 7.2195),
    ((50.0000, 2.5000, 0.0000), (50.0000, 0.0000, -2.5000), 4.3065),
    ((50.0000, 2.5000, 0.0000), (73.0000, 25.0000, -18.0000), 27.1492),
    ((50.0000, 2.5000, 0.0000), (50.0000, 3.1736, 0.5854), 1.0000),
    ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ((90.9257, -0.5406, -0.9208), (88.6381, -0.8985, -0.7239), 1.5381),
    ((2.0776, 0.0795, -1.1350), (0.9033, -0.0636, -0.5514), 0.9082),
]
PRINTED = 5e-5  # four digits are published
# Never of opposite hues: between those the formula has no one mean hue, and jumps (Sharma et al., section 3).
COLOUR = st.tuples(st.floats(0, 100), st.floats(1, 100), st.floats(-100, 100)).map(np.array)


@pytest.mark.parametrize(("a", "b", "published"), PUBLISHED)
def test_differences_are_those_published(a, b, published):
    assert difference(np.array(a), np.array(b)) == pytest.approx(published, abs=PRINTED)


@given(COLOUR, COLOUR)
def test_a_difference_is_mutual_and_of_nothing_is_nothing(a, b):
    assert difference(a, b) == pytest.approx(difference(b, a), abs=1e-9)
    assert difference(a, b) >= 0
    assert difference(a, a) == 0


def test_white_black_and_middle_grey():
    np.testing.assert_allclose(lab_of_linear(np.ones(3)), [100, 0, 0], atol=1e-4)
    np.testing.assert_allclose(lab_of_linear(np.zeros(3)), [0, 0, 0], atol=1e-9)
    assert lab_of_linear(np.full(3, 0.18418651851244416))[0] == pytest.approx(50, abs=1e-6)


def test_srgb_primaries_have_their_known_lab():
    """Red, green, blue of sRGB in L*a*b* D50, as Lindbloom's calculator (www.brucelindbloom.com) gives them."""
    known = [[54.29, 80.81, 69.89], [87.82, -79.29, 80.99], [29.57, 68.30, -112.03]]
    np.testing.assert_allclose(lab_of_linear(np.eye(3)), known, atol=0.03)
