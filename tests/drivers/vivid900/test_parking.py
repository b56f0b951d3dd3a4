"""Parking after work: every action runs, and no error is lost."""

from __future__ import annotations

import pytest

from drivers.scanner import DeviceError
from drivers.vivid900.parking import parked_on_exit


def test_all_actions_run_in_order_after_any_failure() -> None:
    done: list[str] = []

    def jam() -> None:
        done.append("stage")
        raise DeviceError("jammed")

    with (
        pytest.raises(DeviceError, match="jammed"),
        parked_on_exit([lambda: done.append("laser"), jam, lambda: done.append("lamp")]),
    ):
        done.append("work")
    assert done == ["work", "laser", "stage", "lamp"]
    with pytest.raises(KeyboardInterrupt) as stopped, parked_on_exit([jam]):
        raise KeyboardInterrupt
    assert stopped.value.__notes__ == ["and the scanner could not be brought to rest: jammed"]
