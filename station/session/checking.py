"""Records the verdict on a restored page.

Compared with the other pages of its session.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from station.session.corrections import own_edits
from station.session.current_preset import preset_of
from station.session.events import Event
from station.session.history import Page
from station.session.parts import RESTORE, VERDICT, leaf_name, measured_parts
from station.session.rules import DROPPED
from station.session.stages import run_verdict
from station.session.steps import record_run
from station.session.store import Writer

MAX_COMPARED = 100  # pages that a new one is compared with, the latest: three milliseconds each


def lacks_verdict(page: Page) -> bool:
    """Return whether a page is restored and measured, without a verdict."""
    return (
        RESTORE in page.runs and VERDICT not in page.runs and bool(measured_parts(page.runs[RESTORE].facts["result"]))
    )


def record_verdict(writer: Writer, restored: Event) -> Event:
    """Check a restoration by the session's limits, and record the verdict.

    They are those of its preset. Raises OSError when the disk refuses.
    """
    parameters: dict[str, Any] = {
        "thresholds": preset_of(writer.session).thresholds.model_dump(mode="json", exclude_none=True)
    }
    if dict(own_edits(writer.session, writer.history.page(restored.page)).get("by", {})).get("tool") == DROPPED:
        parameters["corrections_dropped"] = True
    others = list(_restored_pages(writer, without=restored.page))[-MAX_COMPARED:]
    run = run_verdict(restored.facts["result"], parameters, fingerprints_of(others))
    return record_run(writer, VERDICT, restored, parameters=parameters, result=run.result, others=others)


def fingerprints_of(restored: Iterable[Event]) -> dict[str, str]:
    """Page, or part of a page → fingerprint, of restorations."""
    return {
        leaf_name(one.page, part): str(measures["fingerprint"])
        for one in restored
        for part, measures in measured_parts(one.facts["result"]).items()
    }


def verdict_lines(name: str, result: Any) -> list[str]:
    """Return a verdict as lines for the operator.

    The level, then each measure that is not green next to its limits, with what to do.
    """
    findings: Sequence[Any] = result["checks"]
    lines = [f"{name}: {str(result['level']).upper()}  {len(findings)} checks"]
    return [*lines, *(_line(one) for one in findings if one["level"] != "green")]


def note_lines(result: Any) -> list[str]:
    """Return what a verdict notes without a level, as lines for the operator."""
    return [f"    note   {one['text']}: {one['hint']}" for one in result.get("notes", ())]


def _line(check: Any) -> str:
    part = f"{check['part']}: " if "part" in check else ""
    return f"    {check['level']:<6} {part}{check['text']}: {check['hint']}"


def _restored_pages(writer: Writer, *, without: int) -> Iterator[Event]:
    for page in writer.history.pages():
        run = page.runs.get(RESTORE)
        if page.number != without and run is not None and measured_parts(run.facts["result"]):
            yield run
