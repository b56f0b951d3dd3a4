"""Green, amber or red: a measure compared with a preset's limits."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

from restore import Finding
from station.verdict.same_page import similarity
from station.verdict.table import MEASURES, Measure
from station.verdict.thresholds import LEVELS, Level, Limits, Thresholds

SIZE_HINT = "compare the page with a ruler; set outline, spine or size: planish session edits"
# Findings that an operator has to answer, whatever the limits: code → name of the check, what to do.
QUESTIONS = {
    "layout_unsure": ("layout", "split the page, or set its layout to whole: planish session edits"),
    "size_differs": ("size", SIZE_HINT),
    "size_wrong": ("size", SIZE_HINT),
}
ASKED: Limits = (0.5, 1.5)  # of the number of such findings, in which a doubt counts twice: one is amber, a doubt red
SAME_PAGE = re.compile(r"as page (\d+(?:/left|/right)?)")


@dataclass(frozen=True)
class Check:
    """One measure and its limits. part: of the page, empty for the whole."""

    name: str
    level: Level
    value: float
    limits: Limits
    text: str
    hint: str
    part: str = ""


CORRECTIONS_DROPPED = Check(
    "corrections",
    "amber",
    1.0,
    ASKED,
    "corrections of the earlier capture do not fit this one and were dropped",
    "make them again: planish session edits",
)

OPERATOR_CHECKS = frozenset({*(name for name, _ in QUESTIONS.values()), CORRECTIONS_DROPPED.name})
"""The checks that an operator answers by a correction."""


def questions(report: Mapping[str, Any]) -> list[Check]:
    """Return the findings of a report that an operator has to answer."""
    found: list[Finding] = []
    with suppress(ValueError):
        found = [one for one in Finding.all_in(report) if one.code in QUESTIONS]
    counts = [2.0 if one.severity == "doubt" else 1.0 for one in found]
    return [
        Check(QUESTIONS[one.code][0], level_of(count, ASKED), count, ASKED, one.text, QUESTIONS[one.code][1])
        for one, count in zip(found, counts, strict=True)
    ]


def check_measures(
    measures: Mapping[str, Any], thresholds: Thresholds, others: Mapping[int, str] | Mapping[str, str]
) -> tuple[Level, tuple[Check, ...]]:
    """Return the level of a page and the checks, the worst first.

    others: page → fingerprint of the other pages.
    """
    likeness = {page: similarity(measures["fingerprint"], other) for page, other in others.items()}
    values = {**measures, "similarity": max(likeness.values(), default=None)}
    checks = []
    for name, limits in thresholds:
        value = values.get(name)
        if limits is not None and value is not None:
            level = level_of(float(value), limits)
            with_page = f" as page {max(likeness, key=lambda n: likeness[n])}" if name == "similarity" else ""
            text = _text(MEASURES[name], value, limits, with_page)
            checks.append(Check(name, level, float(value), limits, text, MEASURES[name].hint))
    return worst([check.level for check in checks]), worst_first(checks)


def worst_first(checks: Iterable[Check]) -> tuple[Check, ...]:
    """The checks in the order in which to look at them."""
    return tuple(sorted(checks, key=lambda check: -LEVELS.index(check.level)))


def level_of(value: float, limits: Limits) -> Level:
    """The level of a value. Where the first limit is the greater one, less is worse.

    >>> level_of(0.95, (0.97, 0.90)), level_of(1.0, (1.5, 2.5)), level_of(9.0, (1.5, 2.5))
    ('amber', 'green', 'red')
    """
    sign = 1.0 if limits[0] <= limits[1] else -1.0
    return LEVELS[(sign * value > sign * limits[0]) + (sign * value > sign * limits[1])]


def worst(levels: Sequence[Level]) -> Level:
    """The worst of the levels, green for none."""
    return max(levels, key=LEVELS.index, default="green")


def as_result(checks: Sequence[Check]) -> dict[str, Any]:
    """The verdict as JSON values, as it is recorded; its checks are under `checks` there."""
    return {"level": worst([check.level for check in checks]), "checks": [_as_json(check) for check in checks]}


def _as_json(check: Check) -> dict[str, Any]:
    table = {**asdict(check), "limits": list(check.limits)}
    return table if check.part else {name: value for name, value in table.items() if name != "part"}


def _text(measure: Measure, value: float, limits: Limits, with_page: str) -> str:
    sign = "<" if limits[0] > limits[1] else ">"
    number = measure.form.partition(" of")[0]
    amber, red = (number.format(limit) for limit in limits)
    return f"{measure.what}{with_page} {measure.form.format(value)} (amber {sign} {amber}, red {sign} {red})"
