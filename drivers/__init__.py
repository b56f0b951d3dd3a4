"""Range scanners: `open_scanner`, `open_turntable` with a turntable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any

from drivers.scanner import CaptureSettings, Scanner, ScannerError, SettingsError, Turner

if TYPE_CHECKING:
    from types import ModuleType

    from drivers.stage import RotaryStage
    from drivers.vivid900.link import Link
    from drivers.vivid900.profile.profile import Profile

__all__ = [
    "CaptureSettings",
    "Scanner",
    "ScannerError",
    "SettingsError",
    "Turner",
    "open_link",
    "open_scanner",
    "open_turntable",
]

# driver name → module with `connect(config) -> Scanner` and `open_link(config)`; imported only when asked for.
DRIVERS = {"simulated": "drivers.simulated", "vivid900": "drivers.vivid900.connecting"}

SIMULATED_PORT = "simulated"


def open_scanner(config: Mapping[str, Any]) -> Scanner:
    """Open the scanner that the table `[scanner]` of a station configuration names.

    Raises SettingsError when the driver or one of its settings is not known.

    >>> scene = {"sheet": "curl", "artwork": "text", "page_mm": [200, 150]}
    >>> with open_scanner({"driver": "simulated", "scene": scene}) as scanner:
    ...     scan = scanner.capture(CaptureSettings(mode="fast", distance_mm=900))
    >>> scan.points.shape
    (240, 320, 3)
    """
    scanner: Scanner = _driver(config).connect(config)
    return scanner


def open_link(config: Mapping[str, Any]) -> tuple[Link, Profile]:
    """Return the link to that scanner and its command profile.

    Nothing is sent to the scanner. Raises as `open_scanner`.
    """
    link: tuple[Link, Profile] = _driver(config).open_link(config)
    return link


def _driver(config: Mapping[str, Any]) -> ModuleType:
    name = config.get("driver")
    if name not in DRIVERS:
        raise SettingsError(f"the scanner driver {name!r} does not exist", f"use one of: {', '.join(sorted(DRIVERS))}")
    return import_module(DRIVERS[name])


@contextmanager
def open_turntable(
    config: Mapping[str, Any], *, model: str, port: str, relative: bool = False
) -> Iterator[tuple[Scanner, RotaryStage]]:
    """Open a scanner and its turntable as a context manager.

    On exit the laser is off, the stage stopped and both are closed.
    config           the table `[scanner]`, as for `open_scanner`.
    model, relative  of the stage's controller, as for `open_stage`.
    port             its serial port; SIMULATED_PORT for a simulated stage before the simulated scanner.
    Raises SettingsError when a setting is not known or not possible, TransportError when a port cannot be opened.
    """
    if port == SIMULATED_PORT and config.get("driver") == "simulated":
        simulated = import_module(DRIVERS["simulated"])
        with simulated.connect_turntable(config, model, relative=relative) as opened:
            yield opened
        return
    if port == SIMULATED_PORT or config.get("driver") == "simulated":
        raise SettingsError(
            "a simulated scanner and a real stage do not see each other",
            f'use port = "{SIMULATED_PORT}" in [turntable] with driver = "simulated" in [scanner], and only there',
        )
    from drivers.stage import open_stage

    # The scanner first: opening it switches its laser off. A killed run may have left the stage turning.
    with open_scanner(config) as scanner, open_stage(model, port, relative=relative) as stage:
        stage.stop()
        yield scanner, stage
