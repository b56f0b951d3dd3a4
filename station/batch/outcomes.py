"""Outcomes of the pages of a batch, and how bad each is compared with the others."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from restore import Finding
from restore.files import read_regular
from station.batch.plan import Plan
from station.intake import records
from station.intake.arrival import Arrival
from station.session.log.results import Checked
from station.verdict.checks import LEVELS, Check, check_measures
from station.verdict.thresholds import Thresholds

Read = Callable[[Mapping[str, Any]], float | None]


@dataclass(frozen=True)
class Figure:
    """Figure of a report.

    Its name for the operator, how it is read and written, and whether less of it is worse.
    """

    name: str
    read: Read
    text: str
    less_is_worse: bool = False


FIGURES = (
    Figure("strain rms", lambda report: report["strain"].get("smooth_rms", report["strain"]["rms"]), "{:.3%}"),
    Figure("inverted triangles", lambda report: report["flipped_faces"], "{:.0f}"),
    Figure("filled in", lambda report: report.get("interpolated_fraction"), "{:.1%}"),
    Figure(
        "source ppi",
        lambda report: report.get("sampling_ppi", report["resolved_ppi"]) or None,
        "{:.0f}",
        less_is_worse=True,
    ),
    Figure("uncertainty", lambda report: report.get("uncertainty_mm", {}).get("total"), "{:.3f} mm"),
    Figure("warnings", lambda report: sum(one.severity != "note" for one in Finding.all_in(report)), "{:.0f}"),
)
"""The figures that order the pages; a page without one (None) is not compared by it."""


@dataclass(frozen=True)
class PageOutcome:
    """One page, or one scan without a page.

    name     the scan, relative to the folder of the batch, and the number of the sheet where it has several.
    state    restored, set aside, or missing when the batch did not come to it.
    picture  its page's file, None without.
    figures  name → value, of FIGURES.
    notes    what the verdict finds, the findings of the report, or why it was set aside.
    size_mm  width and height of the page; None without.
    seconds  of its restoration.
    level    green, amber or red: the verdict; empty without one.
    ci95_mm  half of the 95 % interval of the longer side; None where the calibration is not known.
    preview  as `station.batch.preview` makes it, when it was restored just now; else the report makes it.
    """

    name: str
    state: str
    picture: Path | None = None
    figures: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    size_mm: tuple[float, float] | None = None
    seconds: float = 0.0
    level: str = ""
    ci95_mm: float | None = None
    preview: str = ""


@dataclass(frozen=True)
class Ranked:
    """Page with its rank.

    The rank is the greatest fraction of the other pages that are better by one figure; that figure is named.
    """

    page: PageOutcome
    rank: float
    by: str


def outcomes(plan: Plan, limits: Thresholds) -> Iterator[PageOutcome]:
    """Yield the pages of every scan of a plan, as the records have them.

    They are checked by the measures in their reports.
    """
    for arrival in plan.scans:
        yield from _pages_of(arrival, plan.out, limits)


def worst_first(pages: Sequence[PageOutcome]) -> list[Ranked]:
    """Return pages without a result first, then by level of the verdict, then by rank.

    Ranks need no thresholds, and say nothing of how bad the worst page is: the figures do.
    """
    ranks: dict[int, list[tuple[float, str]]] = {index: [(0.0, "")] for index in range(len(pages))}
    for figure in FIGURES:
        known = [(page.figures[figure.name], index) for index, page in enumerate(pages) if figure.name in page.figures]
        better: dict[float, int] = {}
        for position, (value, _) in enumerate(sorted(known, reverse=figure.less_is_worse)):
            better.setdefault(value, position)
        for value, index in known:
            ranks[index].append((better[value] / len(known), figure.name))
    worst = (max(ranks[index]) for index in range(len(pages)))
    ranked = [Ranked(page, rank, by if rank else "") for page, (rank, by) in zip(pages, worst, strict=True)]
    return sorted(ranked, key=_urgency)


def _urgency(one: Ranked) -> tuple[bool, int, float, str]:
    level = LEVELS.index(one.page.level) if one.page.level in LEVELS else 0
    return one.page.state == "restored", -level, -one.rank, one.page.name


def concerns(checks: Iterable[Check | Checked]) -> tuple[str, ...]:
    """Return the checks that are not green, each in a line."""
    return tuple(f"{one.level}: {one.text}" for one in checks if one.level != LEVELS[0])


def texts_of(report: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the sentences of a report's findings, empty where it was changed."""
    with suppress(ValueError):
        return tuple(one.text for one in Finding.all_in(report))
    return ()


def figures_of(report: Mapping[str, Any]) -> dict[str, float]:
    """The figures of a report, by their names; those that it lacks are left out."""
    values: dict[str, float] = {}
    for figure in FIGURES:
        with suppress(KeyError, TypeError, ValueError):
            if (value := figure.read(report)) is not None:
                values[figure.name] = value
    return values


def ci95_of(report: Mapping[str, Any]) -> float | None:
    """Half of the 95 % interval of the longer side of a page; None where its report has none."""
    with suppress(KeyError, TypeError, ValueError):
        return float(max(report["size_mm_ci95"]))
    return None


def _pages_of(arrival: Arrival, out: Path, limits: Thresholds) -> Iterator[PageOutcome]:
    name = str(arrival.source)
    folder = records.find_result(out, arrival)
    reports = [] if folder is None else [(path, _report(path)) for path in records.reports_of(folder, arrival)]
    for path, report in reports:
        several = f", sheet {path.stem.rpartition('-')[2]}" if len(reports) > 1 else ""
        yield _restored(name + several, path, report, limits)
    if reports:
        return
    note = records.note_of(out, arrival)
    with suppress(OSError, ValueError):
        text = read_regular(note, records.MAX_BYTES).decode("utf-8", "replace")
        yield PageOutcome(name, "set aside", notes=tuple(text.split("\n\n")[0].splitlines()))
        return
    yield PageOutcome(name, "missing", notes=("the batch has not come to it",))


def _restored(name: str, path: Path, report: Mapping[str, Any], limits: Thresholds) -> PageOutcome:
    picture = path.with_suffix(".png")
    width, height = report.get("page_mm", (0.0, 0.0))
    level, findings = check_measures(report.get("measures", {}), limits, {})
    return PageOutcome(
        name,
        "restored",
        picture if picture.is_file() else None,
        figures_of(report),
        (*concerns(findings), *texts_of(report)),
        (width, height),
        float(report.get("seconds", {}).get("total", 0.0)),
        level if findings else "",
        ci95_of(report),
    )


def _report(path: Path) -> Mapping[str, Any]:
    try:
        report = json.loads(read_regular(path, records.MAX_BYTES))
    except (OSError, ValueError, RecursionError):
        return {}
    return report if isinstance(report, dict) else {}
