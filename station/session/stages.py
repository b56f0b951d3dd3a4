"""Stages that derive something from a page's scan: the same bytes from the same input and parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from restore import Settings, read_regular
from station.choices import Pieces, Turn
from station.destination import Destination
from station.one_page import restore_file
from station.progress import Progress, silent

RESTORE = "restore"
STEM = "page"
PAGE, REPORT = f"{STEM}.png", f"{STEM}.json"
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
    """Restore a stored scan into an empty folder, which the run creates; for worker processes, too.

    Raises BadInput, NotEnoughSurface, OSError when the disk refuses.
    """
    wanted = RestoreParameters.model_validate(dict(parameters))
    destination = Destination(
        folder,
        frozenset(wanted.outputs),
        language=wanted.language,
        pieces=Pieces.LARGEST,
        turn=wanted.turn,
        anyway=wanted.anyway,
    )
    restore_file(source, destination, settings=wanted.settings, unit=wanted.unit, stem=STEM, progress=progress)
    report = json.loads(read_regular(folder / REPORT, MAX_REPORT_BYTES))
    (folder / REPORT).unlink()  # the record holds it, without what differs between two runs
    facts = {name: report.pop(name) for name in VARYING if name in report}
    return Run(report, {name: facts[name] for name in ("seconds", "peak_memory_mb")})
