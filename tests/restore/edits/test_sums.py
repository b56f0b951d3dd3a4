"""Corrections added up, carried and named: as the station did it with JSON values.

The functions here are a frozen copy of those that recorded sessions were made with.
"""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from restore import BadInput, PageEdits, parse_edits

Table = dict[str, Any]
COORDINATE = st.integers(0, 99_999).map(lambda number: number / 100)
POINTS = st.lists(st.lists(COORDINATE, min_size=2, max_size=2), min_size=3, max_size=5)
MASK = st.fixed_dictionaries({"what": st.sampled_from(["remove", "keep"]), "polygon": POINTS})
SETTINGS = st.fixed_dictionaries({}, optional={"dpi": st.sampled_from([100.0, 300.0]), "points": st.just(500)})
PART = st.fixed_dictionaries(
    {},
    optional={
        "turn": st.integers(0, 3),
        "rotate_deg": st.integers(-4500, 4500).map(lambda number: number / 100),
        "outline": st.none() | POINTS,
        "masks": st.lists(MASK, max_size=3),
        "crop": st.sampled_from([{"mode": "paper"}, {"mode": "margin", "margin_mm": 3.0}]),
        "size_mm": st.none() | st.just([100.0, 150.0]),
        "settings": SETTINGS,
        "label": st.sampled_from(["", "7"]),
    },
)
EDITS = st.fixed_dictionaries(
    {},
    optional={
        "kind": st.sampled_from([None, "plate", "spread"]),
        "layout": st.sampled_from(["auto", "split", "whole"]),
        "spine": st.none() | POINTS,
        "overlap_mm": st.sampled_from([0.0, 2.5]),
        "parts": st.dictionaries(st.sampled_from(["page", "left", "right"]), PART.filter(bool), min_size=1),
        "note": st.just("x"),
        "by": st.just({"tool": "cli"}),
    },
)


def merged(under: Table, over: Table) -> Table:
    parts = dict(under.get("parts", {}))
    for name, part in over.get("parts", {}).items():
        parts[name] = merged_part(parts.get(name, {}), part)
    return {**under, **over, **({"parts": parts} if parts else {})}


def merged_part(under: Table, over: Table) -> Table:
    table = {**under, **over}
    if over.get("masks"):
        table["masks"] = [*under.get("masks", []), *over["masks"]]
    if "settings" in over:
        table["settings"] = {**under.get("settings", {}), **over["settings"]}
    return table


def without(table: Table, others: Table) -> Table:
    taken = others.get("parts", {})
    parts = {name: part_without(part, taken.get(name, {})) for name, part in table.get("parts", {}).items()}
    kept = {name: part for name, part in parts.items() if part}
    rest = {key: value for key, value in table.items() if key != "parts" and (key == "by" or key not in others)}
    return {**rest, **({"parts": kept} if kept else {})}


def part_without(part: Table, taken: Table) -> Table:
    rest = {key: value for key, value in part.items() if key == "masks" or key not in taken}
    settings = {key: value for key, value in part.get("settings", {}).items() if key not in taken.get("settings", {})}
    return {**rest, **({"settings": settings} if settings else {})}


def has_points(edits: Table) -> bool:
    parts = edits.get("parts", {}).values()
    return bool(edits.get("spine")) or any(part.get("outline") or part.get("masks") for part in parts)


def without_points(edits: Table) -> Table:
    parts = {
        name: {key: value for key, value in part.items() if key not in ("outline", "masks")}
        for name, part in edits.get("parts", {}).items()
    }
    kept = {name: part for name, part in parts.items() if part}
    rest = {name: value for name, value in edits.items() if name not in ("spine", "parts")}
    return rest | ({"parts": kept} if kept else {})


def carried(edits: Table) -> Table:
    def moved(points: list[list[float]]) -> list[list[float]]:
        return [[y + 1.0, x] for x, y in points]

    table = {**edits, "parts": {name: dict(part) for name, part in edits.get("parts", {}).items()}}
    if table.get("spine"):
        table["spine"] = moved(table["spine"])
    for part in table["parts"].values():
        if part.get("outline"):
            part["outline"] = moved(part["outline"])
        if part.get("masks"):
            part["masks"] = [{**mask, "polygon": moved(mask["polygon"])} for mask in part["masks"]]
    return table if table["parts"] else without(table, {"parts": {}})


def fields_of(table: Table) -> list[str]:
    top = [name for name in table if name not in ("parts", "format", "version", "frame", "by", "scan")]
    return top + [f"{part}.{name}" for part, fields in table.get("parts", {}).items() for name in fields]


def edits_of(table: Table) -> PageEdits:
    return parse_edits(json.dumps(table).encode(), "the corrections")


def check(model: PageEdits, table: Table) -> None:
    """Compare what is recorded, shown and given to a restoration, to the byte."""
    expected = edits_of(table)
    assert json.dumps(model.given()) == json.dumps(expected.given())
    assert json.dumps(model.of_image()) == json.dumps(expected.of_image())
    assert model.canonical() == expected.canonical()


@given(EDITS, EDITS)
def test_later_corrections_win_field_by_field_and_masks_add_up(under: Table, over: Table) -> None:
    check(edits_of(under).merged(edits_of(over)), merged(under, over))


@given(EDITS, EDITS)
def test_fields_of_others_are_dropped(table: Table, others: Table) -> None:
    check(edits_of(table).without(edits_of(others)), without(table, others))


@given(EDITS)
def test_points_are_moved_or_dropped_and_fields_named(table: Table) -> None:
    model = edits_of(table)
    assert model.has_points == has_points(table)
    check(model.dropped("spine", "outline", "masks"), without_points(table))
    check(model.moved(lambda points: tuple((y + 1.0, x) for x, y in points)), carried(table))
    assert sorted(model.names) == sorted(fields_of(table))


@given(EDITS)
def test_a_field_is_dropped_from_the_parts_that_are_named(table: Table) -> None:
    dropped = edits_of(table).dropped("turn", of=("left",))
    assert [name for name in edits_of(table).names if name != "left.turn"] == list(dropped.names)


@pytest.mark.parametrize(
    "part", [{"size_mm": [0.001, 9]}, {"crop": {"mode": "box", "box": [5, 5, 5.001, 9]}}, {"masks": []}]
)
def test_corrections_that_round_to_nothing_are_not_corrections(part: Table) -> None:
    model = edits_of({"parts": {"page": part}})
    if "masks" in part:
        model.check()
        return
    with pytest.raises(BadInput):
        model.check()
