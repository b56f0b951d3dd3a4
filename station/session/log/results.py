"""Results of stages as records hold them: a restoration, a quality check.

Keys that a later program adds are kept and not read.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, create_model

from station.session.terms.parts import LEFT, PAGE, PARTS, RIGHT
from station.verdict.checks import LEVELS, OPERATOR_CHECKS, SAME_PAGE, worst
from station.verdict.packed import unpack
from station.verdict.table import MEASURES
from station.verdict.thresholds import Level

# Of either kind, as it was written: it is shown and written again as it stands.
Number = Annotated[int, Field(ge=-1e9, le=1e9)] | Annotated[float, Field(allow_inf_nan=False, ge=-1e9, le=1e9)]
Length = Annotated[int, Field(gt=0.0, le=1e9)] | Annotated[float, Field(allow_inf_nan=False, gt=0.0, le=1e9)]
Pair = Annotated[list[Number], Field(min_length=2, max_length=2)]
Lengths = Annotated[list[Length], Field(min_length=2, max_length=2)]
Part = Literal["page", "left", "right"]


def _fingerprint(text: str) -> str:
    unpack(text)
    return text


class Facts(BaseModel):
    """Facts of an event, or a part of them."""

    model_config = ConfigDict(strict=True, extra="allow", frozen=True)


class Fingerprint(Facts):
    """The fingerprint of a page, next to its measures."""

    fingerprint: Annotated[str, AfterValidator(_fingerprint)]


_numbers: Any = dict.fromkeys(MEASURES, (Number | None, None))
Measures = create_model("Measures", __base__=Fingerprint, **_numbers)


class Found(Facts):
    """A finding of a restoration."""

    code: str = ""


class Restored(Facts):
    """The result of a restoration."""

    error: str | None = None
    hint: str = ""
    method: str | None = None
    page_mm: Lengths | None = None
    dpi: Length | None = None
    measures: Measures | None = None
    part: Any = None
    parts: dict[Part, Restored] = {}
    findings: list[Found] = []
    layout: Facts | None = None
    leaf_mm: Lengths | None = None
    uncertainty_mm: Any = None

    @property
    def leaves(self) -> Mapping[str, Restored]:
        """Part → its result. A whole that is kept next to its leaves is left out."""
        kept: dict[str, Restored] = {name: self.parts[name] for name in (LEFT, RIGHT) if name in self.parts}
        return kept or {str(self.part) if self.part in PARTS else PAGE: self}

    @property
    def is_split(self) -> bool:
        """Whether it is two leaves."""
        return len(self.leaves) > 1

    @property
    def is_measured(self) -> bool:
        """Whether a part of it could be restored."""
        return any(leaf.measures is not None for leaf in self.leaves.values())

    @property
    def failures(self) -> Iterator[tuple[str, Restored]]:
        """Part and result, of the parts that could not be restored."""
        return ((part, leaf) for part, leaf in self.leaves.items() if leaf.error is not None)

    @property
    def failure(self) -> dict[str, str] | None:
        """Why it failed, with a hint; None for one with a page."""
        return None if self.error is None else {"text": self.error, "hint": self.hint}

    @property
    def codes(self) -> frozenset[str]:
        """Codes of its findings."""
        return frozenset(one.code for one in self.findings)


class Checked(Facts):
    """One measure next to its limits, amber and red."""

    name: str
    level: Level
    value: Number
    limits: Pair
    text: str
    hint: str
    part: str = ""

    @property
    def past(self) -> float:
        """Its position from the amber limit on.

        A fraction of the way to the red limit and beyond, below 1.
        """
        amber, red = self.limits
        way = max((self.value - amber) / ((red - amber) or 1.0), 0.0)
        return min(way / (1.0 + way), 0.999)

    @property
    def is_question(self) -> bool:
        """Whether a correction answers it."""
        return self.name in OPERATOR_CHECKS and self.level != "green"

    @property
    def same_as(self) -> str | None:
        """The page or part that was found the same."""
        found = SAME_PAGE.search(self.text) if self.name == "similarity" and self.level != "green" else None
        return found[1] if found else None


class Note(Facts):
    """What a quality check notes without a level."""

    text: str
    hint: str


class QualityCheck(Facts):
    """The result of the quality check."""

    level: Level
    checks: list[Checked]
    notes: list[Note] = []

    def of(self, part: str) -> Sequence[Checked]:
        """The checks of a part, and those of the whole."""
        return [check for check in self.checks if check.part in ("", part)]

    def keeping(self, names: Collection[str]) -> QualityCheck:
        """Return the check without those that found the same as leaf sides of these names."""
        checks = [check for check in self.checks if check.same_as not in names]
        found = {"checks": checks, "level": worst([check.level for check in checks])}
        return self if len(checks) == len(self.checks) else self.model_copy(update=found)

    @property
    def rank(self) -> float:
        """How bad it is: the number of its level, and how far its worst measure is past the limit."""
        return LEVELS.index(self.level) + max((one.past for one in self.checks if one.level == self.level), default=0.0)
