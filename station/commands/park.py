"""`planish park`: the laser off and the turntable stopped.

Whatever an earlier run left behind.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from drivers.scanner import LASER_MAY_BE_ON, ScannerError
from station.commands.options import Config, Debug
from station.commands.terminal import print_result, report_faults

if TYPE_CHECKING:
    from station.config import StationConfig


def park(config: Config, debug: Debug = False) -> None:
    """Switch the laser off and stop the turntable."""
    with report_faults(debug=debug):
        from station.config import load_config

        park_station(load_config(config), report=print_result)


def park_station(config: StationConfig, *, report: Callable[[str], None]) -> None:
    """Park the scanner, then the turntable, if any.

    The second even when the first fails.
    report: called with a line for each that is parked.
    Raises the first ScannerError, with a note for a second one, and with LASER_MAY_BE_ON when a scanner with a laser
    failed.
    """
    from drivers import driver_of

    errors: list[ScannerError] = []
    has_laser = "laser" in driver_of(config.scanner).facts
    try:
        _park_scanner(config)
        report(f"scanner: {'the laser is off' if has_laser else 'closed; nothing is known of its laser'}")
    except ScannerError as error:
        if has_laser:
            error.add_note(LASER_MAY_BE_ON)
        errors.append(error)
    try:
        if _park_stage(config):
            report("turntable: stopped")
    except ScannerError as error:
        errors.append(error)
    if errors:
        for other in errors[1:]:
            errors[0].add_note(f"and the turntable could not be stopped: {other}")
        raise errors[0]


def _park_scanner(config: StationConfig) -> None:
    import drivers

    drivers.open_scanner(config.scanner).close()  # every opening switches the laser off


def _park_stage(config: StationConfig) -> bool:
    """Stop the turntable.

    Returns False when it does not exist.
    """
    from drivers import SIMULATED_PORT
    from drivers.stage import open_stage

    if config.turntable is None or config.turntable.port == SIMULATED_PORT:
        return False
    open_stage(config.turntable.model, config.turntable.port, relative=config.turntable.relative).close()
    return True
