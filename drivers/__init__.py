"""Range scanners. `open_scanner(config)` is the only door."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from drivers.scanner import CaptureSettings, Scanner, ScannerError, SettingsError

__all__ = ["CaptureSettings", "Scanner", "ScannerError", "SettingsError", "open_scanner"]

# driver name → module with a function `connect(config) -> Scanner`; imported only when asked for.
DRIVERS = {"simulated": "drivers.simulated", "vivid900": "drivers.vivid900.connecting"}


def open_scanner(config: Mapping[str, Any]) -> Scanner:
    """Open the scanner that the table `[scanner]` of a station configuration names.

    Raises SettingsError when the driver or one of its settings is not known.
    """
    name = config.get("driver")
    if name not in DRIVERS:
        raise SettingsError(f"there is no scanner driver {name!r}", f"use one of: {', '.join(sorted(DRIVERS))}")
    scanner: Scanner = import_module(DRIVERS[name]).connect(config)
    return scanner
