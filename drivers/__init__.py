"""Range scanners: `open_scanner`, `open_turntable` with a turntable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from drivers.scanner import CaptureSettings, ScanFile, Scanner, ScannerError, SettingsError, Turner

if TYPE_CHECKING:
    from drivers.stage import RotaryStage
    from drivers.vivid900.link import Link
    from drivers.vivid900.profile.profile import Profile

__all__ = [
    "CaptureSettings",
    "ScanFile",
    "Scanner",
    "ScannerError",
    "SettingsError",
    "Turner",
    "open_link",
    "open_scanner",
    "open_turntable",
    "settings_of",
]

Fact = Literal["laser", "depth window", "calibration"]


class Driver(NamedTuple):
    """A driver, whose modules are imported only when it is asked for.

    module    with `connect(config) -> Scanner`. It may have `open_link(config)`, as `open_link` here, and
              `connect_turntable(config, model, *, relative)` where its scanner has a stage of its own.
    settings  module with `settings_of(config) -> type[CaptureSettings]`.
    facts     what is known of each of its captures: whether the laser is on, and so on.
    """

    module: str
    settings: str
    facts: frozenset[Fact] = frozenset()


VIVID: frozenset[Fact] = frozenset({"laser", "depth window", "calibration"})
DRIVERS = {
    "folder": Driver("drivers.folder.scanner", "drivers.folder.config"),
    "program": Driver("drivers.program.scanner", "drivers.program.config"),
    "simulated": Driver("drivers.simulated", "drivers.vivid900.settings", VIVID),
    "vivid900": Driver("drivers.vivid900.connecting", "drivers.vivid900.settings", VIVID),
}

SIMULATED_PORT = "simulated"


def open_scanner(config: Mapping[str, Any]) -> Scanner:
    """Open the scanner that the table `[scanner]` of a station configuration names.

    Raises SettingsError when the driver or one of its settings is not known.

    >>> from drivers.vivid900.settings import VividSettings
    >>> scene = {"sheet": "curl", "artwork": "text", "page_mm": [200, 150]}
    >>> with open_scanner({"driver": "simulated", "scene": scene}) as scanner:
    ...     scan = scanner.capture(VividSettings(mode="fast", distance_mm=900))
    >>> scan.points.shape
    (240, 320, 3)
    """
    scanner: Scanner = import_module(driver_of(config).module).connect(config)
    return scanner


def settings_of(config: Mapping[str, Any]) -> type[CaptureSettings]:
    """Return the class of the settings of a capture by that scanner. Raises as `open_scanner`."""
    settings: type[CaptureSettings] = import_module(driver_of(config).settings).settings_of(config)
    return settings


def open_link(config: Mapping[str, Any]) -> tuple[Link, Profile]:
    """Return the link to that scanner and its command profile.

    Nothing is sent to the scanner. Raises as `open_scanner`, and SettingsError for a driver without commands.
    """
    module = import_module(driver_of(config).module)
    if not hasattr(module, "open_link"):
        raise SettingsError(
            f"the driver {config['driver']!r} sends no commands of its own", "name a configuration of a Vivid 900"
        )
    link: tuple[Link, Profile] = module.open_link(config)
    return link


def driver_of(config: Mapping[str, Any]) -> Driver:
    """Return the driver that a table names. Raises SettingsError."""
    name = config.get("driver")
    if not isinstance(name, str) or name not in DRIVERS:
        raise SettingsError(f"the scanner driver {name!r} does not exist", f"use one of: {', '.join(sorted(DRIVERS))}")
    return DRIVERS[name]


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
    own = getattr(import_module(driver_of(config).module), "connect_turntable", None)
    if (own is not None) != (port == SIMULATED_PORT):
        raise SettingsError(
            "a simulated scanner and a real stage do not see each other",
            f'use port = "{SIMULATED_PORT}" in [turntable] with driver = "simulated" in [scanner], and only there',
        )
    if own is not None:
        with own(config, model, relative=relative) as opened:
            yield opened
        return
    from drivers.stage import open_stage

    # The scanner first: opening it switches its laser off. A killed run may have left the stage turning.
    with open_scanner(config) as scanner, open_stage(model, port, relative=relative) as stage:
        stage.stop()
        yield scanner, stage
