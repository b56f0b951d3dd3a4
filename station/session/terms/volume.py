"""What a session is of: the fields that are given when it is made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

MAX_TEXT = 500  # a title page's worth
# Values of a preset that its programs of format 2 do not know: they stand next to `volume` in the facts, not in it.
ADDED = ("layout", "size_mm", "overlap_mm", "direction")


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

    def facts(self) -> dict[str, Any]:
        """Return the facts of the first event, with ADDED values apart.

        >>> Volume(title="A", preset_values={"layout": "auto"}).facts()["layout"]
        'auto'
        """
        table = self.model_dump(mode="json", exclude_none=True)
        values = table["preset_values"]
        return {"volume": table, **{name: values.pop(name) for name in ADDED if name in values}}


def volume_of_facts(facts: Mapping[str, Any]) -> Volume:
    """The volume of the event that a session begins with. Raises ValidationError."""
    volume = Volume.model_validate(facts["volume"])
    added = {name: facts[name] for name in ADDED if name in facts}
    return volume.model_copy(update={"preset_values": {**volume.preset_values, **added}}) if added else volume
