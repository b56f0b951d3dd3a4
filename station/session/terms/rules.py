"""Define corrections as events hold them: of a page, and rules for many."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter

from restore import BadInput, PageEdits, parse_edits

EDITS, RULES = "edits", "rules"  # names of the decisions
CARRIED, DROPPED = "carried", "dropped"  # tools that correct a page which was captured again
MAX_RULES = 1000
Table = Mapping[str, Any]


def edits_of(table: Table) -> PageEdits:
    """Corrections from JSON values. Raises BadInput that names the field."""
    try:
        data = json.dumps(dict(table)).encode()
    except RecursionError as error:
        raise BadInput("the corrections are nested too deeply", "make them again") from error
    return parse_edits(data, "the corrections")


def recorded(table: Table) -> dict[str, Any]:
    """Return corrections as an event holds them. Raises BadInput, also for points in space."""
    edits = edits_of(table)
    if edits.frame != "picture":
        raise BadInput("frame: corrections in space are for loose scans", "draw them on the picture of the page")
    return edits.given()


def _checked(table: dict[str, Any] | None) -> dict[str, Any] | None:
    """Raise ValueError for corrections that no operator can have made.

    Returns them, or None where none are given.
    """
    try:
        recorded(table or {})
    except BadInput as error:
        raise ValueError(str(error)) from error
    return table


EditsTable = Annotated[dict[str, Any] | None, AfterValidator(_checked)]


class Scope(BaseModel):
    """The pages of a rule, as they were when it was made.

    captures  numbers of their scans, or all. side: of the corrected parts. future: also those captured later.
    over      scans whose own earlier corrections give way to the rule, field by field.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
    captures: list[int] | Literal["all"] = "all"
    side: Literal["any", "left", "right", "single"] = "any"
    future: bool = False
    over: list[int] = []


class Rule(BaseModel):
    """Corrections of many pages.

    id     number of the event that recorded it.
    edits  the corrections that were given, as `PageEdits.given`; they name the parts that they are of.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
    id: int
    scope: Scope
    edits: Annotated[dict[str, Any], AfterValidator(_checked)]

    def is_on(self, shots: Sequence[int]) -> bool:
        """Whether the rule is on a page.

        shots: number of its scan, and of those that it replaced, back to the first.
        """
        later = self.scope.future and shots[-1] > self.id
        if self.scope.captures == "all":
            return later or shots[-1] < self.id
        return later or not set(shots).isdisjoint(self.scope.captures)

    def as_json(self) -> dict[str, Any]:
        """Return the rule as it is recorded."""
        return self.model_dump(mode="json", exclude=None if self.scope.over else {"scope": {"over"}})

    def is_over(self, own: int, shots: Sequence[int]) -> bool:
        """Whether the rule takes the place of own corrections of a page.

        own: the event that recorded them.
        """
        return own < self.id and not set(shots).isdisjoint(self.scope.over)


RULES_TABLE: TypeAdapter[list[Rule]] = TypeAdapter(Annotated[list[Rule], Field(max_length=MAX_RULES)])


def merged(under: Table, over: Table) -> dict[str, Any]:
    """Merge corrections, those on top winning field by field.

    Masks add up, and an empty list takes them away.

    >>> merged({"layout": "whole", "parts": {"page": {"turn": 1}}}, {"parts": {"page": {"rotate_deg": 0.5}}})
    {'layout': 'whole', 'parts': {'page': {'turn': 1, 'rotate_deg': 0.5}}}
    """
    parts = dict(under.get("parts", {}))
    for name, part in over.get("parts", {}).items():
        parts[name] = _merged_part(parts.get(name, {}), part)
    return {**under, **over, **({"parts": parts} if parts else {})}


def without(table: Table, others: Table) -> dict[str, Any]:
    """Take the fields of others out of corrections. Masks stay, since they add up.

    >>> without({"layout": "whole", "parts": {"page": {"turn": 1}}}, {"parts": {"page": {"turn": 2}}})
    {'layout': 'whole'}
    """
    taken = others.get("parts", {})
    parts = {name: _part_without(part, taken.get(name, {})) for name, part in table.get("parts", {}).items()}
    kept = {name: part for name, part in parts.items() if part}
    rest = {key: value for key, value in table.items() if key != "parts" and (key == "by" or key not in others)}
    return {**rest, **({"parts": kept} if kept else {})}


def _part_without(part: Table, taken: Table) -> dict[str, Any]:
    rest = {key: value for key, value in part.items() if key == "masks" or key not in taken}
    settings = {key: value for key, value in part.get("settings", {}).items() if key not in taken.get("settings", {})}
    return {**rest, **({"settings": settings} if settings else {})}


def _merged_part(under: Table, over: Table) -> dict[str, Any]:
    table = {**under, **over}
    if over.get("masks"):
        table["masks"] = [*under.get("masks", []), *over["masks"]]
    if "settings" in over:
        table["settings"] = {**under.get("settings", {}), **over["settings"]}
    return table
