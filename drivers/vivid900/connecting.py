"""From the `[scanner]` table of a station configuration to a Vivid 900."""

from __future__ import annotations

from pathlib import Path

from drivers.scanner import SettingsError
from drivers.vivid900.calibration import Calibration, nominal, read_calibration
from drivers.vivid900.camera import CalibrationOf
from drivers.vivid900.commands import Status
from drivers.vivid900.lenses import LENSES


def calibrations(path: Path | None) -> CalibrationOf:
    """The calibration of a file for the lens and body that it was made for; the manual's figures without a file.

    Raises SettingsError when the file cannot be read; what is returned raises it for another lens or body.
    """
    if path is None:
        return _nominal
    calibration = read_calibration(path)

    def calibration_of(status: Status) -> Calibration:
        mounted = {"lens": status.lens, "lens_serial": str(status.lens_serial), "body": str(status.body_serial)}
        for what, found in mounted.items():
            wanted = getattr(calibration, what)
            if wanted and wanted != found:
                raise SettingsError(
                    f"{path} is the calibration of {what.replace('_', ' ')} {wanted}, and the scanner has {found}",
                    "name the calibration of this lens on this body, or make one with `planish calibrate`",
                )
        return calibration

    return calibration_of


def _nominal(status: Status) -> Calibration:
    return nominal(LENSES[status.lens], body=str(status.body_serial), lens_serial=str(status.lens_serial))
