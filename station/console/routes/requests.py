"""What requests may bring: every field with its limits."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from station.archive.formats import Format
from station.session.log.events import MAX_NUMBER, MAX_PAGE
from station.session.terms.labels import Run
from station.session.terms.volume import MAX_TEXT

MAX_NOTE = 2000
NAME = r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}$"

PageNumber = Annotated[int, Field(ge=1, le=MAX_PAGE)]
EventNumber = Annotated[int, Field(ge=1, le=MAX_NUMBER)]
Tab = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{16,64}$")]
SessionName = Annotated[str, Field(min_length=1, max_length=255)]
LeafName = Annotated[str, Field(pattern=r"^[1-9][0-9]{0,3}(/(left|right))?$")]
Text = Annotated[str, Field(max_length=MAX_TEXT)]
OnPage = Literal["again", "insert", "accept", "reject", "keep_both", "mark", "note", "side"]
Action = Literal["capture", "preview", "undo", "redo", OnPage]


class _Request(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class TakeControl(_Request):
    """Take control for a tab, or give it away."""

    tab: Tab
    take: bool = True


class NewSession(_Request):
    """A session to be made. words: read those of its pages, to be searched."""

    name: Annotated[str, Field(pattern=NAME)]
    title: Annotated[str, Field(pattern=r"\S", max_length=MAX_TEXT)]
    project: Text = ""
    organisation: Text = ""
    preset: Annotated[str, Field(pattern=r"^[a-z]{1,40}$")] = "book"
    words: bool = False


class OpenRequest(_Request):
    """read_only: look at a session that another process has."""

    read_only: bool = False


class Press(_Request):
    """One action of the operator. page: the current one where it is absent."""

    action: Action
    page: PageNumber | None = None
    text: Annotated[str, Field(max_length=MAX_NOTE)] | None = None


class ChangedSettings(_Request):
    """Settings by their keys; null brings back that of the preset."""

    values: Annotated[dict[Annotated[str, Field(max_length=60)], JsonValue], Field(max_length=60)]


class Corrections(_Request):
    """Corrections of a page, as a file of corrections has them; null takes all away."""

    edits: Annotated[dict[str, JsonValue], Field(max_length=60)] | None


class RuleScope(_Request):
    """The pages of a rule: by the numbers of their scans, and those captured later.

    over: scans whose own corrections give way.
    """

    captures: Annotated[list[EventNumber], Field(min_length=1, max_length=MAX_PAGE)] | Literal["all"]
    side: Literal["any", "left", "right", "single"] = "any"
    future: bool = False
    over: Annotated[list[EventNumber], Field(max_length=MAX_PAGE)] = []


class NewRule(_Request):
    """Corrections of many pages."""

    scope: RuleScope
    edits: Annotated[dict[str, JsonValue], Field(min_length=1, max_length=60)]


class MovedLeaves(_Request):
    """Leaf sides to be moved before another one; null: to the end."""

    leaves: Annotated[list[LeafName], Field(min_length=1, max_length=2 * MAX_PAGE)]
    before: LeafName | None = None


class LabelRun(_Request):
    """A run of labels that begins at a leaf side; null: none does."""

    leaf: LeafName
    run: Run | None


class MissingLeaves(_Request):
    """Labels of the leaf sides that are missing before another one."""

    before: LeafName
    labels: Annotated[list[Annotated[str, Field(max_length=80)]], Field(max_length=20)]


class ChangedLeaf(_Request):
    """What is changed of a leaf side; null leaves it as it is."""

    leaf: LeafName
    left_out: Annotated[bool, Field(strict=True)] | None = None
    label: Annotated[str, Field(max_length=100)] | None = None


class Described(_Request):
    """The description of a volume: fields as `planish session about` has them."""

    about: dict[str, JsonValue]


class Batch(_Request):
    """Sessions to be restored where they are not."""

    sessions: Annotated[list[SessionName], Field(min_length=1, max_length=200)]
    workers: Annotated[int, Field(ge=1, le=64)] | None = None


class Export(_Request):
    """An export of a session, the open one where none is named."""

    session: SessionName | None = None
    format: Format
    url: Annotated[str, Field(max_length=500, pattern=r"^https?://[^\s<>\"]+$")] | None = None
