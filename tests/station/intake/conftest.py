"""A watched folder on a virtual clock, and a restoration that is quick: it takes files that end in END."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from drivers.simulated.device.clock import VirtualClock
from restore import BadInput, Settings
from station.intake.loop import Event, Pace, Watch
from station.intake.presets import Presets
from station.run.one_page import Destination, Outcome, stem_of
from station.run.options import RunOptions
from station.storage.atomic import lock_output_folder, write_all

PACE = Pace(poll_s=1.0, settle_s=3.0, pair_s=10.0)
WHOLE = b"o page\nEND\n"


@dataclass
class Library:
    """Stands in for `restore_file`. fault: raised in place of the work; calls: what was asked for."""

    fault: BaseException | None = None
    calls: list[tuple[str, frozenset[str], Settings, tuple[str, ...]]] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)

    def __call__(
        self,
        source: Path,
        destination: Destination,
        options: RunOptions,
        *,
        facts: Mapping[str, Any],
        stem: str | None = None,
    ) -> Outcome:
        data = source.read_bytes()
        adjacent = tuple(sorted(str(path.relative_to(source.parent)) for path in source.parent.rglob("*.*")))
        self.calls.append((source.name, options.outputs, options.settings, adjacent))
        self.units[source.name] = options.unit
        if self.fault is not None:
            raise self.fault
        if not data.endswith(b"END\n"):
            raise BadInput(f"{source} is cut short", "export it again")
        stem = stem or stem_of(source)
        files = [(destination.folder / f"{stem}.png", data)]
        files.append((destination.folder / f"{stem}.json", json.dumps({"files": [], **facts}).encode()))
        return Outcome(facts, tuple(write_all(files)))


@dataclass
class Station:
    """A watched folder and its results. events: (what, scan, text)."""

    folder: Path
    out: Path
    clock: VirtualClock = field(default_factory=VirtualClock)
    library: Library = field(default_factory=Library)
    events: list[tuple[Event, str, str]] = field(default_factory=list)

    def watch(self, **options: Any) -> Watch:
        """A new watch, as after a start of the program."""
        presets = Presets(self.folder, options.pop("base", RunOptions()))
        notify = options.pop("notify", lambda event, path, text: self.events.append((event, str(path), text)))
        return Watch(
            self.folder,
            self.out,
            presets,
            self.library,
            notify,
            PACE,
            clock=self.clock,
            sleep=self.clock.sleep,
            **options,
        )

    def put(self, name: str, data: bytes = WHOLE) -> Path:
        """Write a file into the folder."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        return path

    def run(self, watch: Watch | None = None) -> Watch:
        """Watch until nothing is waited for."""
        watch = watch or self.watch()
        watch.once = True
        watch.run()
        return watch

    def pass_time(self, watch: Watch, seconds: float) -> None:
        """Let a watch go on for so long."""
        end = self.clock() + seconds
        with lock_output_folder(self.out):
            while self.clock() < end:
                if "worked" not in watch.poll():
                    self.clock.sleep(PACE.poll_s)

    def results(self) -> dict[str, bytes]:
        """The restored pages: path below the results → content."""
        found = {path: path.read_bytes() for path in self.out.rglob("*.png") if path.is_file()}
        return {str(path.relative_to(self.out)): data for path, data in found.items()}

    def notes(self) -> dict[str, str]:
        """The notes of failures: path below the results → text."""
        return {
            str(path.relative_to(self.out)): path.read_text()
            for path in (self.out / "failed").rglob("*")
            if path.is_file()
        }

    def originals(self) -> dict[str, bytes]:
        """Everything in the watched folder."""
        return {
            str(path.relative_to(self.folder)): path.read_bytes() for path in self.folder.rglob("*") if path.is_file()
        }


@pytest.fixture
def station(tmp_path: Path) -> Station:
    (tmp_path / "in").mkdir()
    return Station(tmp_path / "in", tmp_path / "out")
