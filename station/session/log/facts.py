"""Facts of events other than results of stages, as records hold them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from typing import Annotated, Any

from pydantic import AfterValidator, Field, TypeAdapter

from restore import PageEdits
from station.run.options import READING
from station.session.log.results import Facts, Number
from station.session.terms.about import ABOUT, ABOUT_TABLE, About
from station.session.terms.labels import LABELS, LEAF_ORDER, MISSING_LEAVES, RUNS, Missing, Run
from station.session.terms.rules import EDITS, RULES, RULES_TABLE, RecordedEdits, Rule

SETTINGS = "settings"  # the decision on the volume that changes settings of its preset


def inside(name: str) -> str:
    """Return a path that stays in its folder. Raises ValueError for another one."""
    path = PurePosixPath(name)
    if not name or "\0" in name or path.is_absolute() or ".." in path.parts:
        raise ValueError("it leads out of the folder of its event")
    return name


class Created(Facts):
    """Facts of the first event."""

    id: str
    volume: dict[str, Any]


class Captured(Facts):
    """Facts of a capture.

    scan   its path among its files. unit, grid, depth: as for `load_scan`.
    scale  of photographs, as `planish photos --scale` has it; None for a scan.
    """

    scan: Annotated[str, AfterValidator(inside)]
    unit: str = "auto"
    grid: str = "auto"
    depth: str = "auto"
    scale: str | None = None
    provenance: dict[str, Any] = Field(default_factory=dict)

    @property
    def reading(self) -> dict[str, str]:
        """How it is read, for `load_scan`: what was recorded of it."""
        return {name: getattr(self, name) for name in READING if name in self.model_fields_set}

    @property
    def is_photographed(self) -> bool:
        """Whether it is a set of photographs, and no scan."""
        return self.scale is not None


class Parameters(Facts):
    """Facts of a stage, apart from its result."""

    parameters: dict[str, Any] = Field(default_factory=dict)


VALUES: Mapping[str, TypeAdapter[Any]] = {
    **{name: TypeAdapter(str) for name in ("label", "label_left", "label_right", "side", "note")},
    **{name: TypeAdapter(bool) for name in ("mark", "accept")},
    "position": TypeAdapter(Number),
    SETTINGS: TypeAdapter(dict[str, dict[str, Any]]),
    EDITS: TypeAdapter(RecordedEdits | None),
    RULES: RULES_TABLE,
    **{name: TypeAdapter(bool) for name in ("left_out", "left_out_left", "left_out_right")},
    **dict.fromkeys(("order", "keep_both"), LEAF_ORDER),
    "missing": MISSING_LEAVES,
    LABELS: RUNS,
    ABOUT: ABOUT_TABLE,
}


@dataclass(frozen=True)
class Decisions:
    """What was decided on a page or on the volume; None or empty where nothing was.

    keep_both        leaf sides that the scan was found the same as, and that are other pages.
    label, left_out  of the page where it is one leaf side; of a leaf with its name at the end.
    settings         of the preset that were changed, by group.
    """

    accept: bool | None = None
    keep_both: Sequence[str] = ()
    mark: bool = False
    note: str = ""
    position: float | None = None
    side: str | None = None
    label: str | None = None
    label_left: str | None = None
    label_right: str | None = None
    left_out: bool | None = None
    left_out_left: bool | None = None
    left_out_right: bool | None = None
    edits: PageEdits | None = None
    rules: Sequence[Rule] = ()
    order: Sequence[str] = ()
    missing: Sequence[Missing] = ()
    labels: Sequence[Run] = ()
    about: About = field(default_factory=About)
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
