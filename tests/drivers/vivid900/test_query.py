"""Asking a scanner: its blocks, and what it says while it cannot answer."""

from __future__ import annotations

import pytest

from drivers.vivid900.errors import ProfileMismatch
from drivers.vivid900.profile.profile import load_profile
from drivers.vivid900.query import ask


def test_blocks_with_names_and_numbers(stand, large_chunks):
    identity, (status, parameters) = ask(stand.link(), large_chunks)
    assert identity.product == "SIM VIVID 900"
    assert status.values["state"] == "3 (ready)"
    assert parameters.values["mode"] == "0 (FINE_COLOUR)"
    assert len(parameters.data) == 16
    assert not status.problem + parameters.problem


def test_a_scanner_that_warms_up_says_so(stand, large_chunks):
    stand.device.power_off()
    stand.device.power_on()
    _, (status, parameters) = ask(stand.link(), large_chunks)
    assert status.values["state"] == "1 (warming-up)"
    assert "warming up" in parameters.problem
    _, (polled, _) = ask(stand.link(), load_profile("variants/no-status"))
    assert "warming-up" in polled.problem


def test_a_profile_of_another_firmware_asks_nothing(stand, large_chunks):
    other = large_chunks.firmware.model_copy(update={"product": "VIVID 910"})
    with pytest.raises(ProfileMismatch):
        ask(stand.link(), large_chunks.model_copy(update={"firmware": other}))
    assert "status" not in {event.detail for event in stand.device.log.named("command")}
