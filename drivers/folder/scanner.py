"""A folder as a Scanner: each scan that is saved there is the next shot."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from fnmatch import fnmatch
from pathlib import Path
from threading import Lock
from typing import Any

from drivers.folder.config import FolderConfig, read
from drivers.safety.device_context import DeviceContext
from drivers.scanner import CaptureSettings, DeviceError, Progress, ScanFile, SettingsError, TransportError

Stamp = tuple[int, int]  # size in bytes, time of the last change in ns


def _silent(step: str, done: float) -> None:
    """Progress callback that does nothing."""


class FolderScanner(DeviceContext):
    """A scanner that is triggered by hand.

    Raising from `progress` cancels the wait for a shot.
    Files that are there when it is opened are not shots, until they are written again. A file of the same name as an
    earlier one is a new shot.
    """

    close_failure = "and the folder could not be closed"

    def __init__(
        self,
        config: FolderConfig,
        *,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Note what is in the folder. Raises SettingsError when it cannot be read."""
        self._config, self._clock, self._sleep, self._open = config, clock, sleep, True
        self.identity = str(config.folder)
        self._lock = Lock()
        try:
            self._taken = self._files()
        except TransportError as error:
            raise SettingsError(f"scanner.folder: {error}", "create the folder, or name another one") from error
        self._seen, self._since = self._taken, clock()

    def wait(self, seconds: float) -> bool:
        """See SelfTriggered. False while the folder cannot be read."""
        end = self._clock() + seconds
        while True:
            try:
                if self._next() is not None:
                    return True
            except TransportError:
                pass
            if self._clock() >= end:
                return False
            self._sleep(min(0.1, seconds))

    def capture(self, settings: CaptureSettings, progress: Progress = _silent) -> ScanFile:
        """Wait for the oldest finished scan that was not captured yet, and return it.

        Raises DeviceError when none comes in time, TransportError when the folder cannot be read.
        """
        if not self._open:
            raise TransportError("the scanner is closed", "open it again")
        limit_s = settings.deadline_s or self._config.timeout_s
        start = self._clock()
        while (path := self._next()) is None:
            passed = self._clock() - start
            if passed >= limit_s:
                raise DeviceError(
                    f"no new {self._config.pattern} came within {limit_s:g} s",
                    f"save the scan in {self._config.folder}",
                )
            progress("waiting for a scan", passed / limit_s)
            self._sleep(0.1)
        with self._lock:
            self._taken = {**self._taken, path: self._seen[path]}
        reading = {"unit": self._config.unit, "grid": self._config.grid, "depth": self._config.depth}
        return ScanFile(path, reading, {"device": self.identity})

    def close(self) -> None:
        """Take no more shots. Safe to call twice."""
        self._open = False

    def _next(self) -> Path | None:
        """The oldest scan not taken yet, once the folder has not changed for `settle_s`."""
        with self._lock:
            files, now = self._files(), self._clock()
            if files != self._seen:
                self._seen, self._since = files, now
            new = [path for path in files if self._is_scan(path) and self._taken.get(path) != files[path]]
            if not new or now - self._since < self._config.settle_s:
                return None
            return min(new, key=lambda path: (files[path][1], path))

    def _is_scan(self, path: Path) -> bool:
        return fnmatch(path.name, self._config.pattern) and self._seen[path][0] > 0

    def _files(self) -> dict[Path, Stamp]:
        """The stamps of the files in the folder, without hidden ones."""
        found = {}
        try:
            for path in self._config.folder.iterdir():
                if not path.name.startswith(".") and path.is_file():
                    about = path.stat()
                    found[path] = (about.st_size, about.st_mtime_ns)
        except FileNotFoundError as error:
            if self._config.folder.is_dir():  # a file was removed meanwhile
                return self._files()
            raise TransportError(f"{self._config.folder} does not exist", "connect its disk again") from error
        except OSError as error:
            raise TransportError(f"{self._config.folder}: {error.strerror}", "look at its disk") from error
        return found


def connect(config: Mapping[str, Any]) -> FolderScanner:
    """Open the scanner that a table describes. Raises SettingsError."""
    return FolderScanner(read(config))
