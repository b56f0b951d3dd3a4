"""Stages that derive something from a page's scan.

The same bytes from the same input and parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from restore import RestoreError, Settings
from station.choices import Rotation, Sheets
from station.progress import Progress, silent
from station.run.destination import Destination
from station.run.one_page import restore_file
from station.run.options import RunOptions
from station.run.photos import photographed_page
from station.session.photographs import pictures_in
from station.verdict.judge import as_result, judge
from station.verdict.measures import left_out_fraction, measured
from station.verdict.thresholds import Thresholds

RESTORE, VERDICT = STAGES = "restore", "verdict"
STEM = "page"
PAGE, REPORT = f"{STEM}.png", f"{STEM}.json"
# Of a report: what differs between two runs, and what only the place of the files decides.
VARYING = ("seconds", "peak_memory_mb", "scan", "photographs", "files")


class RestoreParameters(BaseModel):
    """All that a restoration depends on in addition to its scan.

    As `planish restore` has it. Of several sheets in one scan the largest is the page: a page of a session is one
    picture.
    scale: of photographs, as `planish photos` has it; None for a scan.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    settings: Settings = Settings()
    outputs: tuple[str, ...] = ("coverage",)
    language: str = "eng"
    unit: str = "auto"
    scale: str | None = None
    rotate: Rotation = Rotation.NONE
    allow_distorted: bool = False

    def options(self) -> RunOptions:
        """The options of the run."""
        outputs = frozenset({*self.outputs, "coverage"})
        return RunOptions(**{**dict(self), "outputs": outputs, "sheets": Sheets.LARGEST})


@dataclass(frozen=True)
class Run:
    """Result of a stage, in addition to its files.

    result: follows from input and parameters.
    facts: does not: seconds, memory.
    """

    result: Mapping[str, Any]
    facts: Mapping[str, Any] = field(default_factory=dict)


Submit = Callable[[Path, Mapping[str, Any], Path], Future[Run]]
"""`run_restore` in the background, with a future for its result."""


def run_restore(source: Path, parameters: Mapping[str, Any], folder: Path, *, progress: Progress = silent) -> Run:
    """Restore a stored scan into a new folder, and measure the page.

    For worker processes, too. A scan that cannot be restored gives a result with `error` and no files. Raises OSError
    when the disk refuses.
    """
    options = RestoreParameters.model_validate(dict(parameters)).options()
    try:
        restored = (
            partial(restore_file, source) if options.scale is None else partial(photographed_page, pictures_in(source))
        )
        outcome = restored(Destination(folder), options, stem=STEM, examine=measured, progress=progress)
    except RestoreError as error:  # of the scan, and so the same on the next run
        folder.mkdir(parents=True, exist_ok=True)
        return Run({"error": str(error), "hint": error.hint})
    (folder / REPORT).unlink()  # the record holds it, without what differs between two runs
    result = {name: value for name, value in outcome.report.items() if name not in VARYING}
    result["measures"] = {**result["measures"], "left_out_fraction": left_out_fraction(outcome.report)}
    return Run(result, {name: outcome.report[name] for name in ("seconds", "peak_memory_mb")})


def run_verdict(measures: Mapping[str, Any], parameters: Mapping[str, Any], others: Mapping[int, str]) -> Run:
    """Return the verdict on a restored page.

    parameters: `thresholds`.
    others: page → fingerprint of those compared with.
    """
    thresholds = Thresholds.model_validate(parameters["thresholds"])
    return Run(as_result(*judge(measures, thresholds, others)))
