"""Define corrections as events hold them: of a page, and rules for many."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, TypeAdapter

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


def recorded(edits: PageEdits) -> dict[str, Any]:
    """Return corrections as an event holds them. Raises BadInput, also for points in space."""
    edits.check()
    if edits.frame != "picture":
        raise BadInput("frame: corrections in space are for loose scans", "draw them on the picture of the page")
    return edits.given()


def _parsed(value: Any) -> PageEdits:
    """Return the corrections of an event. Raises ValueError for invalid ones."""
    try:
        edits = value if isinstance(value, PageEdits) else edits_of(value)
        recorded(edits)
    except BadInput as error:
        raise ValueError(str(error)) from error
    return edits


RecordedEdits = Annotated[PageEdits, BeforeValidator(_parsed), PlainSerializer(PageEdits.given)]


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
    edits  the corrections that were given; they name the parts that they are of.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
    id: int
    scope: Scope
    edits: RecordedEdits

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
