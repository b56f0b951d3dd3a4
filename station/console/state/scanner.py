"""The one owner of the scanner.

It is opened once, used by one thread, and its laser is off except during a capture.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, Literal

import drivers
from drivers import CaptureSettings, Scanner, ScannerError
from drivers.scanner import LASER_MAY_BE_ON, SelfTriggered, Shot
from station.capture_loop.turning import Place, turn
from station.config import StationConfig
from station.console.faults import ConsoleFault, problem_of

Busy = Literal["capture", "preview", "connect"]
Laser = Literal["off", "on", "unknown"] | None  # None: of a scanner whose driver does not know
Open = Callable[[Any], Scanner]


class Ending(ScannerError):
    """Raised in a shot that does not end in time when the server ends."""


@dataclass
class Shown:
    """The scanner as it is shown. step, done: of what it is doing, 0 to 1."""

    connected: bool = False
    name: str | None = None
    lens: str | None = None
    distance_mm: float | None = None
    laser: Laser = "off"
    busy: Busy | None = None
    step: str | None = None
    done: float | None = None
    since: datetime | None = None
    problem: dict[str, Any] | None = None


@dataclass
class ScannerOwner:
    """The scanner of a station.

    Its methods may be called from any thread; the scanner itself has a separate one.
    config: None without a scanner.
    changed: is called when what is shown has changed.
    """

    config: StationConfig | None
    changed: Callable[[], None]
    now: Callable[[], datetime]
    open_scanner: Open = drivers.open_scanner

    def __post_init__(self) -> None:
        self._lock = threading.Lock()
        self._thread = ThreadPoolExecutor(1, "scanner")
        self._scanner: Scanner | None = None
        self._shown = Shown()
        self._cancelled = threading.Event()
        self.configured = CaptureSettings() if self.config is None else self.config.capture
        self.settings = self.configured
        self._facts = drivers.VIVID if self.config is None else drivers.driver_of(self.config.scanner).facts
        if self.config is not None:
            self._shown.lens = self.config.scanner.get("lens")

    def reserve(self, what: Busy) -> None:
        """Reserve the scanner for one capture.

        Raises ConsoleFault without a scanner, or when it is busy.
        """
        if self.config is None:
            raise ConsoleFault("no_scanner", "no scanner is configured", "start planish serve with --config")
        with self._lock:
            if self._shown.busy is not None:
                raise ConsoleFault(
                    "busy", "the scanner is capturing", "wait until it has ended", doing=self._shown.busy
                )
            self._shown.busy, self._shown.since = what, self.now()
        self.changed()

    def release(self) -> None:
        """Give the scanner back."""
        self._show(busy=None, step=None, done=None, since=None)

    def connect(self) -> Future[None]:
        """Open the scanner, unless it is open: every opening switches its laser off.

        A fault is shown, not raised.
        """
        self.reserve("connect")

        def work() -> None:
            try:
                self._opened()
            except ScannerError as error:
                self._failed(error)
            finally:
                self.release()

        return self._thread.submit(work)

    def capture(self) -> Shot:
        """Capture with the settings as they are, and wait.

        Raises ScannerError; the laser is off by then.
        """
        return self._thread.submit(self._capture, self.settings).result()

    def turn(self, place: Place) -> None:
        """Have the leaves turned, where the scanner turns them. Raises ScannerError."""
        self._thread.submit(self._turn, place).result()

    def preview(self, place: Place) -> Future[Shot]:
        """One quick shot of a place."""
        self._thread.submit(self._turn, place)
        return self._thread.submit(self._capture, self.settings.preview())

    @property
    def unmeasured(self) -> frozenset[str]:
        """The quality measures that its captures do not have."""
        return frozenset() if "depth window" in self._facts else frozenset({"depth_window_fraction"})

    @property
    def is_self_triggered(self) -> bool:
        """Whether the scanner is open, and triggered by hand."""
        return isinstance(self._scanner, SelfTriggered)

    @property
    def has_shot(self) -> bool:
        """Whether a scanner that is triggered by hand has a shot that waits."""
        scanner = self._scanner
        return isinstance(scanner, SelfTriggered) and self._shown.busy is None and scanner.wait(0)

    def cancel(self) -> None:
        """Let a shot end at its next step, with an error."""
        self._cancelled.set()

    def close(self) -> None:
        """Switch the laser off, close the scanner, end its thread. Raises ScannerError."""
        try:
            self._thread.submit(self._close).result()
        finally:
            self._thread.shutdown(wait=True)

    def as_json(self) -> dict[str, Any]:
        """The scanner as it is shown."""
        with self._lock:
            shown = replace(self._shown)
        config, settings = self.config, self.settings
        stage = config.turntable if config is not None else None
        return {
            "configured": config is not None,
            "connected": shown.connected,
            "name": shown.name,
            "driver": None if config is None else config.scanner["driver"],
            "lens": shown.lens,
            "mode": getattr(settings, "mode", None),
            "distance_mm": shown.distance_mm or getattr(settings, "distance_mm", None),
            "laser": shown.laser if "laser" in self._facts else None,
            "busy": shown.busy,
            "step": shown.step,
            "done": shown.done,
            "since": None if shown.since is None else shown.since.isoformat(timespec="milliseconds"),
            "problem": shown.problem,
            "stage": None if stage is None else {"model": stage.model, "port": stage.port, "arc_deg": stage.arc_deg},
        }

    def _opened(self) -> Scanner:
        if self._scanner is None:
            assert self.config is not None
            self._scanner = self.open_scanner(self.config.scanner)
            name = str(getattr(self._scanner, "identity", self.config.scanner["driver"]))
            self._show(connected=True, name=name, laser="off", problem=None)
        return self._scanner

    def _capture(self, settings: CaptureSettings) -> Shot:
        try:
            scanner = self._opened()
            self._show(laser="on", problem=None)
            scan = scanner.capture(settings, self._progress)
        except ScannerError as error:
            self._failed(error)
            raise
        except BaseException as error:
            self._show(laser="unknown", problem=problem_of(error))
            raise
        facts = scan.provenance
        self._show(laser="off", lens=facts.get("lens"), distance_mm=facts.get("distance_mm"))
        return scan

    def _turn(self, place: Place) -> None:
        try:
            turn(self._opened(), place)
        except ScannerError as error:
            self._failed(error)
            raise

    def _failed(self, error: ScannerError) -> None:
        """Show a fault.

        A scanner that does not answer any more is opened again by the next capture.
        """
        laser: Laser = "unknown" if LASER_MAY_BE_ON in getattr(error, "__notes__", ()) else "off"
        if isinstance(error, drivers.scanner.TransportError) and self._scanner is not None:
            scanner, self._scanner = self._scanner, None
            try:
                scanner.close()
            except ScannerError:
                laser = "unknown"
            self._show(connected=False)
        self._show(laser=laser, problem=problem_of(error))

    def _progress(self, step: str, done: float) -> None:
        if self._cancelled.is_set():
            raise Ending("the server is ending", "capture the page again")
        self._show(step=step, done=done)

    def _close(self) -> None:
        if self._scanner is not None:
            scanner, self._scanner = self._scanner, None
            self._show(connected=False, laser="unknown")
            scanner.close()
            self._show(laser="off")

    def _show(self, **values: Any) -> None:
        with self._lock:
            for name, value in values.items():
                setattr(self._shown, name, value)
        self.changed()
