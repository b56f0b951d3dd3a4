"""A program as a Scanner: run for each shot, it writes a file, which is the scan."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any

from drivers.program.config import PLACE, ProgramConfig, read, replaced
from drivers.program.runner import run
from drivers.safety.device_context import DeviceContext
from drivers.scanner import CaptureSettings, DeviceError, Progress, ScanFile, ScannerError, TransportError

PREFIX = "planish-shot-"


def _silent(step: str, done: float) -> None:
    """Progress callback that does nothing."""


class ProgramScanner(DeviceContext):
    """A scanner that is a program. Raising from `progress` cancels a capture.

    identity  what `check` printed, or else the program's name.
    """

    close_failure = "and the scanner could not be parked"

    def __init__(self, config: ProgramConfig, *, sleep: Callable[[float], None] = time.sleep) -> None:
        """Check that the scanner is ready. Raises SettingsError, DeviceError."""
        self._config, self._sleep, self._open = config, sleep, True
        self._place: dict[str, object] = dict.fromkeys(PLACE, 0)
        words = [word for word in config.capture if "{" not in word]
        self.identity = next((Path(word).stem for word in words if not word.startswith("-")), "program")
        if config.check is not None:
            lines = self._run(config.check).splitlines()
            self.identity = lines[0].strip() if lines else self.identity

    def capture(self, settings: CaptureSettings, progress: Progress = _silent) -> ScanFile:
        """Run the program and return the file that it has written.

        Raises SettingsError, DeviceError, TransportError; the scanner is parked then.
        """
        if not self._open:
            raise TransportError("the scanner is closed", "open it again")
        values = asdict(settings)
        limit_s = settings.deadline_s or self._config.timeout_s
        folder = Path(mkdtemp(prefix=PREFIX))
        output = folder / self._config.output
        table = {**values, "deadline_s": limit_s, **self._place, "output": output}
        environment = {f"PLANISH_{name.upper()}": str(value) for name, value in table.items()}
        try:
            run(
                replaced(self._config.capture, table),
                folder=folder,
                environment=environment,
                limit_s=limit_s,
                progress=progress,
            )
            self._require_finished(output)
        except BaseException as error:
            self._after(error, folder)
            raise
        return ScanFile(output, self._config.reading, {"device": self.identity, "settings": values}, folder)

    def close(self) -> None:
        """Park the scanner. Safe to call twice."""
        if self._open:
            self._open = False
            self._park()

    def _run(self, command: list[str]) -> str:
        with TemporaryDirectory(prefix=PREFIX) as folder:
            return run(
                replaced(command, {}),
                folder=Path(folder),
                environment={},
                limit_s=self._config.timeout_s,
                progress=_silent,
            )

    def _park(self) -> None:
        if self._config.park is not None:
            self._run(self._config.park)

    def _after(self, error: BaseException, folder: Path) -> None:
        """Park after a shot that failed, and name the files that it left."""
        try:
            self._park()
        except ScannerError as fault:
            error.add_note(f"{self.close_failure}: {fault}")
        if any(folder.iterdir()):
            error.add_note(f"what the program wrote is kept: {folder}")
        else:
            rmtree(folder, ignore_errors=True)

    def _require_finished(self, output: Path) -> None:
        """Raise DeviceError for a file that is missing, empty, or still being written."""
        size = _size(output)
        self._sleep(self._config.settle_s)
        if size == 0:
            raise DeviceError(f"the program wrote no {output.name}", "let it write its scan to {output}")
        if _size(output) != size:
            raise DeviceError(
                f"{output.name} was still being written after the program had ended",
                "let the program end when its file is complete",
            )


class TurningProgram(ProgramScanner):
    """A program that turns the leaves to an {opening} before it captures."""

    def turn_to(self, opening: int, attempt: int) -> None:
        """See Turner."""
        self._place = {"opening": opening, "attempt": attempt}


def connect(config: Mapping[str, Any]) -> ProgramScanner:
    """Open the scanner that a table describes. Raises SettingsError, then as ProgramScanner."""
    table = read(config)
    return (TurningProgram if "opening" in table.named else ProgramScanner)(table)


def _size(path: Path) -> int:
    return path.stat().st_size if path.is_file() else 0
