"""The byte of a status block that has the state of the scanner."""

from __future__ import annotations

import pytest

from drivers.trace.groups import Group
from drivers.trace.roles import Guess
from drivers.trace.states import States, find_states
from drivers.vivid900.profile.template import Checksum
from tests.drivers.trace.test_guesses import READ, RELEASE, STATUS, said

ROLES = {STATUS: "status", RELEASE: "release", READ: "read_pitch"}
# Byte 0 is random, byte 1 counts the shots, byte 2 is 3 when ready, 4 when busy, 5 with data.
READY, *CAPTURES = (9, 0, 3), ((7, 1, 4), (2, 1, 5)), ((4, 2, 4), (4, 2, 5))
FOUND = States(2, {"ready": 3, "busy": 4, "data": 5})


def recorded(*captures):
    """Exchanges of captures, each given by the status blocks after its release, and the guesses at their roles."""
    order = [said(STATUS, bytes(READY))]
    for blocks in captures:
        order += [said(RELEASE), *(said(STATUS, bytes(block)) for block in blocks), said(READ, b"x")]
    order = [said(one.cdb, one.data, number) for number, one in enumerate(order)]
    return order, [Guess(Group(tuple(e for e in order if e.cdb == cdb)), role, "") for cdb, role in ROLES.items()]


def test_the_state_is_what_a_release_changes():
    order, guesses = recorded(*CAPTURES)
    assert find_states(order, guesses, None) == FOUND
    assert find_states(order, guesses, Checksum(kind="sum8", at=2)) is None
    assert find_states(order[:1], guesses, None) is None


@pytest.mark.parametrize("blocks", [(), ((4, 3, 4),)], ids=["no status", "one status"])
def test_a_capture_without_two_statuses_after_its_release_is_skipped(blocks):
    assert find_states(*recorded(*CAPTURES, blocks), None) == FOUND
