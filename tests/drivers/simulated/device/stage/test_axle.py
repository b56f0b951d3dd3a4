"""The axle of the simulated stage: even motion, stops, and counting from another place."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.simulated.device.stage.axle import Axle

places = st.floats(-1e5, 1e5)


@given(start=places, goal=places, speed=st.floats(1, 1e4), share=st.floats(0, 1))
def test_it_moves_evenly_and_arrives_when_the_distance_is_run(start, goal, speed, share):
    axle = Axle(start)
    axle.go(goal, speed, 0.0)
    end = abs(goal - start) / speed
    assert axle.position(share * end) == pytest.approx(start + share * (goal - start), abs=1e-6)
    assert axle.position(end) == goal
    assert not axle.moving(end)


def test_a_halt_leaves_it_where_it_is():
    axle = Axle()
    axle.go(100.0, 10.0, 0.0)
    assert axle.moving(4.0)
    axle.halt(4.0)
    assert not axle.moving(4.0)
    assert axle.position(4.0) == axle.position(50.0) == 40.0


def test_a_new_goal_on_the_way_starts_from_where_it_is():
    axle = Axle()
    axle.go(100.0, 10.0, 0.0)
    axle.go(0.0, 10.0, 5.0)
    assert axle.position(7.0) == pytest.approx(30.0)
    assert axle.position(10.0) == 0.0
