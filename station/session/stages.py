"""Stages that derive something from a page's scan: the same bytes from the same input and parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tifffile
from PIL import Image
from pydantic import BaseModel, ConfigDict

from restore import RestoreError, Settings, load_scan, read_regular
from station.choices import Pieces, Turn
from station.destination import Destination
from station.one_page import restore_file
from station.progress import Progress, silent
from station.session.presets import Thresholds
from station.verdict.judge import as_result, judge
from station.verdict.measures import Measures, measure

RESTORE, VERDICT = "restore", "verdict"
STEM = "page"
PAGE, REPORT, MAP = f"{STEM}.png", f"{STEM}.json", f"{STEM}-map.tif"
MAX_REPORT_BYTES = 2**24
# Of a report: what differs between two runs, and what only the place of the files decides.
VARYING = ("seconds", "peak_memory_mb", "scan", "files")


class RestoreParameters(BaseModel):
    """All that a restoration depends on beside its scan, as `planish restore` has it.

    Of several sheets in one scan the largest is the page: a page of a session is one picture.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    settings: Settings = Settings()
    outputs: tuple[str, ...] = ("coverage",)
    language: str = "eng"
    unit: str = "auto"
    turn: Turn = Turn.NONE
    anyway: bool = False


@dataclass(frozen=True)
class Run:
    """What a stage gave, beside its files.

    result  follows from input and parameters. facts  does not: seconds, memory.
    """

    result: Mapping[str, Any]
    facts: Mapping[str, Any] = field(default_factory=dict)


def run_restore(source: Path, parameters: Mapping[str, Any], folder: Path, *, progress: Progress = silent) -> Run:
    """Restore a stored scan into a new folder, and measure the page; for worker processes, too.

    A scan that cannot be restored gives a result with `error` and no files. Raises OSError when the disk refuses.
    """
    wanted = RestoreParameters.model_validate(dict(parameters))
    destination = Destination(
        folder,
        frozenset({*wanted.outputs, "coverage", "map"}),
        language=wanted.language,
        pieces=Pieces.LARGEST,
        turn=wanted.turn,
        anyway=wanted.anyway,
    )
    try:
        restore_file(source, destination, settings=wanted.settings, unit=wanted.unit, stem=STEM, progress=progress)
    except RestoreError as error:  # of the scan, and so the same on the next run
        folder.mkdir(parents=True, exist_ok=True)
        return Run({"error": str(error), "hint": error.hint})
    report = json.loads(read_regular(folder / REPORT, MAX_REPORT_BYTES))
    (folder / REPORT).unlink()  # the record holds it, without what differs between two runs
    facts = {name: report.pop(name) for name in VARYING if name in report}
    report["measures"] = _measures(source, folder, wanted, report)
    return Run(report, {name: facts[name] for name in ("seconds", "peak_memory_mb")})


def _measures(source: Path, folder: Path, wanted: RestoreParameters, report: Mapping[str, Any]) -> Measures:
    """The measures of the page in a folder; the map is removed unless it was asked for."""
    image = np.asarray(Image.open(folder / PAGE).convert("RGB"))
    coverage = np.asarray(Image.open(folder / f"{STEM}-coverage.png"))
    page_map = tifffile.imread(folder / MAP)[..., :2]
    if "map" not in wanted.outputs:
        (folder / MAP).unlink()
    return measure(image, coverage, page_map, report["dpi"], load_scan(source, unit=wanted.unit), report)


def run_verdict(measures: Mapping[str, Any], parameters: Mapping[str, Any], others: Mapping[int, str]) -> Run:
    """The verdict on a restored page. parameters: `thresholds`. others: page → fingerprint of those compared with."""
    thresholds = Thresholds.model_validate(parameters["thresholds"])
    return Run(as_result(*judge(measures, thresholds, others)))
