"""What a session is of: the fields that are given when it is made."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

MAX_TEXT = 500  # a title page's worth


class Volume(BaseModel):
    """A volume.

    project       what it belongs to: a collection, an order.
    title         of the volume.
    organisation  who keeps it; may be empty.
    preset        name of the preset that the session began with.
    station       configuration of the station that shoots it, unless another one is named; may be empty.
    preset_values the whole of that preset, so that a later change of its file changes no session.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    project: str = Field(default="", max_length=MAX_TEXT)
    title: str = Field(max_length=MAX_TEXT)
    organisation: str = Field(default="", max_length=MAX_TEXT)
    preset: str = Field(default="book", max_length=MAX_TEXT)
    station: str = Field(default="", max_length=4096)
    preset_values: dict[str, Any] = {}
