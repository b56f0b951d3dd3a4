"""Records the verdict on a restored page, compared with other pages of its session."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from station.session.corrections.layers import own_edits
from station.session.derivation.restoration import Run
from station.session.log.current import preset_of
from station.session.log.events import Event
from station.session.log.history import Page
from station.session.log.results import Checked, QualityCheck
from station.session.log.steps import record_run
from station.session.log.store import Writer
from station.session.terms.parts import VERDICT, leaf_name, measured_parts, parts_of
from station.session.terms.rules import DROPPED
from station.verdict.calibration_notes import calibration_notes
from station.verdict.checks import CORRECTIONS_DROPPED, Check, as_result, check_measures, questions, worst_first
from station.verdict.thresholds import Thresholds

MAX_COMPARED = 100  # pages that a new one is compared with, the latest: three milliseconds each


def lacks_verdict(page: Page) -> bool:
    """Return whether a page is restored and measured, without a verdict."""
    return page.quality is None and page.restored is not None and page.restored.is_measured


def record_verdict(writer: Writer, restored: Event) -> QualityCheck:
    """Check a restoration by the session's limits, record the verdict and return it.

    They are those of its preset. Raises OSError when the disk refuses.
    """
    parameters: dict[str, Any] = {
        "thresholds": preset_of(writer.session).thresholds.model_dump(mode="json", exclude_none=True)
    }
    if own_edits(writer.session, writer.history.page(restored.page)).by.tool == DROPPED:
        parameters["corrections_dropped"] = True
    others = list(_restored_pages(writer, without=restored.page))[-MAX_COMPARED:]
    run = run_verdict(restored.result, parameters, fingerprints_of(others))
    event = record_run(writer, VERDICT, restored, parameters=parameters, result=run.result, others=others)
    assert event.checked is not None
    return event.checked


def fingerprints_of(restored: Iterable[Event]) -> dict[str, str]:
    """Page, or part of a page → fingerprint, of restorations."""
    return {
        leaf_name(one.page, part): leaf.measures.fingerprint
        for one in restored
        if one.restored is not None
        for part, leaf in one.restored.leaves.items()
        if leaf.measures is not None
    }


def verdict_lines(name: str, quality: QualityCheck) -> list[str]:
    """Return a verdict as lines for the operator.

    The level, then each measure that is not green next to its limits, with what to do.
    """
    lines = [f"{name}: {quality.level.upper()}  {len(quality.checks)} checks"]
    return [*lines, *(_line(one) for one in quality.checks if one.level != "green")]


def note_lines(quality: QualityCheck) -> list[str]:
    """Return what a verdict notes without a level, as lines for the operator."""
    return [f"    note   {one.text}: {one.hint}" for one in quality.notes]


def _line(check: Checked) -> str:
    part = f"{check.part}: " if check.part else ""
    return f"    {check.level:<6} {part}{check.text}: {check.hint}"


def _restored_pages(writer: Writer, *, without: int) -> Iterator[Event]:
    for page in writer.history.pages():
        run = page.restoration
        if page.number != without and run is not None and run.result.is_measured:
            yield run.event


def run_verdict(result: Mapping[str, Any], parameters: Mapping[str, Any], others: Mapping[str, str]) -> Run:
    """The verdict on a restoration: of its parts, each check with the part that it is of.

    parameters: `thresholds`, and `corrections_dropped` of a page that was captured again.
    others: page or part of a page → fingerprint of those compared with.
    """
    thresholds = Thresholds.model_validate(parameters["thresholds"])
    parts, measured_ones = parts_of(result), measured_parts(result)
    lost = {"left_out_fraction": 1.0} if len(measured_ones) < len(parts) else {}  # the other leaf, as large as this
    checks: list[Check] = []
    for part, measures in measured_ones.items():
        found = (*check_measures({**measures, **lost}, thresholds, others)[1], *questions(parts[part]))
        checks += [replace(check, part=part) for check in found] if len(parts) > 1 else found
    checks += [CORRECTIONS_DROPPED] if parameters.get("corrections_dropped") else []
    notes = next(filter(None, map(calibration_notes, parts.values())), [])
    return Run({**as_result(worst_first(checks)), **({"notes": notes} if notes else {})})
