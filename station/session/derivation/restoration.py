"""Stages that derive from a page's scan: same input and parameters give same bytes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from restore import RestoreError, Settings
from restore.runtime import Kept
from station.choices import Layout, Rotation, Sheets
from station.progress import Progress, silent
from station.run.destination import Destination, Outcome
from station.run.one_page import restore_file
from station.run.options import RunOptions
from station.run.photos import photographed_page
from station.session.captures.photographs import pictures_in
from station.session.terms.parts import STEM
from station.session.terms.rules import edits_of
from station.verdict.measures import left_out_fraction, measured

PAGE = f"{STEM}.png"
# Of a report: what differs between two runs, and what only the place of the files decides.
VARYING = ("seconds", "peak_memory_mb", "scan", "photographs", "files")
RESOURCES = ("seconds", "peak_memory_mb")


class RestoreParameters(BaseModel):
    """All that a restoration depends on in addition to its scan.

    As `planish restore` has it. Of several sheets in one scan the largest is the page, unless they are the leaves of an
    opened book.
    scale: of photographs, as `planish photos` has it; None for a scan.
    edits: corrections by hand, as `PageEdits`; None without.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    settings: Settings = Settings()
    outputs: tuple[str, ...] = ("coverage",)
    language: str = "eng"
    unit: str = "auto"
    grid: str = "auto"
    depth: str = "auto"
    scale: str | None = None
    rotate: Rotation = Rotation.NONE
    allow_distorted: bool = False
    layout: Layout = Layout.SINGLE
    edits: dict[str, Any] | None = None

    def options(self) -> RunOptions:
        """The options of the run."""
        outputs = frozenset({*self.outputs, "coverage"})
        edits = None if self.edits is None else edits_of(self.edits)
        return RunOptions(
            **{**dict(self), "outputs": outputs, "sheets": Sheets.LARGEST, "both_leaves": True, "edits": edits}
        )


@dataclass(frozen=True)
class Run:
    """Result of a stage, in addition to its files.

    result: follows from input and parameters.
    facts: does not: seconds, memory.
    """

    result: Mapping[str, Any]
    facts: Mapping[str, Any] = field(default_factory=dict)


def run_restore(
    source: Path, parameters: Mapping[str, Any], folder: Path, *, kept: Kept | None = None, progress: Progress = silent
) -> Run:
    """Restore a stored scan into a new folder, and measure the page; for worker processes.

    A scan that cannot be restored gives a result with `error` and no files. Raises OSError when the disk refuses.
    kept: results of an earlier restoration of the same scan.
    """
    options = replace(RestoreParameters.model_validate(dict(parameters)).options(), kept=kept)
    try:
        restored = (
            partial(restore_file, source) if options.scale is None else partial(photographed_page, pictures_in(source))
        )
        outcome = restored(Destination(folder), options, stem=STEM, examine=measured, progress=progress)
    except RestoreError as error:  # of the scan, and so the same on the next run
        folder.mkdir(parents=True, exist_ok=True)
        return Run({"error": str(error), "hint": error.hint})
    for path in folder.glob(f"{STEM}*.json"):
        path.unlink()  # the record holds it, without what differs between two runs
    if "sheets" not in outcome.report:
        return Run(_result(outcome.report), {name: outcome.report[name] for name in RESOURCES})
    parts = {str(report["part"]): _result(report) for report in outcome.report["sheets"]}
    return Run({"parts": parts | _failed(outcome)}, _resources(outcome))


def _result(report: Mapping[str, Any]) -> dict[str, Any]:
    """What follows from input and parameters, of the report of a page."""
    result = {name: value for name, value in report.items() if name not in VARYING}
    return {**result, "measures": {**result["measures"], "left_out_fraction": left_out_fraction(report)}}


def _failed(outcome: Outcome) -> dict[str, dict[str, str]]:
    """The leaves of an opened book that could not be restored, with the reasons."""
    return {str(one["part"]): {"error": str(one["reason"]), "hint": ""} for one in outcome.report["rejected"]}


def _resources(outcome: Outcome) -> dict[str, Any]:
    """Seconds of each stage and the peak of the memory, over the parts of a restoration."""
    reports = outcome.report["sheets"]
    seconds = dict(reports[0]["seconds"])
    for report in reports[1:]:
        for stage, more in report["seconds"].items():
            seconds[stage] = seconds.get(stage, 0.0) + more
    return {"seconds": seconds, "peak_memory_mb": max(report["peak_memory_mb"] for report in reports)}
