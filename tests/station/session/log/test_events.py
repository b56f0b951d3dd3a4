"""Records of events as lines of JSON."""

from __future__ import annotations

import json
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.session.log.events import FOLDER, MAX_RECORD_BYTES, Event, EventDamaged, Input, decode, encode, slot_of

EVENT = Event(
    number=7,
    page=3,
    kind="stage",
    slot="restore@5",
    parent=6,
    time="2026-01-02T03:04:05.000Z",
    software="planish 0.1.0",
    facts={"parameters": {"dpi": 150.0}, "text": "Blatt 3ʳ\n"},
    inputs=(Input(5, "ab"),),
    files={"page.png": "cd"},
)
VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
)


@given(facts=st.dictionaries(st.text(), VALUES, max_size=4))
def test_a_record_is_read_as_it_was_written(facts):
    event = Event(2, 1, "decision", "note", None, "t", "s", facts)
    line = encode(event)
    assert line.count(b"\n") == 1
    assert decode(line) == event


def test_the_names_of_an_event():
    assert (EVENT.name, EVENT.on, EVENT.folder) == ("restore", 5, "0003-000007-restore")
    assert slot_of("restore", EVENT) == "restore@7"
    assert FOLDER.fullmatch(EVENT.folder)


def test_every_flipped_bit_of_a_record_is_found_or_is_another_record():
    line = encode(EVENT)
    for position in range(len(line)):
        for bit in range(8):
            flipped = bytearray(line)
            flipped[position] ^= 1 << bit
            with suppress(EventDamaged):
                assert decode(bytes(flipped)) != EVENT


@pytest.mark.parametrize(
    "change",
    [
        {"number": 0},
        {"number": 1_000_000},
        {"page": -1},
        {"page": 10_000},
        {"parent": 7},
        {"parent": 0},
        {"slot": "restore@7"},
        {"slot": "Restore"},
        {"slot": "../x"},
        {"kind": "other"},
        {"format": 0},
        {"format": 3},
        {"inputs": [{"event": 9, "sha512": ""}]},
        {"number": "7"},
        {"more": 1},
    ],
)
def test_a_record_that_cannot_be_is_refused(change):
    table = json.loads(encode(EVENT)) | change
    line = json.dumps(table, sort_keys=True, ensure_ascii=False, separators=(",", ":")).encode() + b"\n"
    with pytest.raises(EventDamaged):
        decode(line)


@pytest.mark.parametrize("facts", [{"x": float("nan")}, {"x": "a" * MAX_RECORD_BYTES}])
def test_facts_that_no_record_holds(facts):
    with pytest.raises(ValueError, match=r"JSON|bytes"):
        encode(Event(1, 0, "session", "session", None, "t", "s", facts))
