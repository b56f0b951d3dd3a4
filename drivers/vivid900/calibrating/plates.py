"""Converts stored scans of plates into the measurements that a calibration needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivers.scanner import SettingsError
from drivers.vivid900.calibrating.board import Board, detect_board
from drivers.vivid900.calibrating.bundle_adjustment import PlateShot
from drivers.vivid900.geometry.calibration import Calibration, calibration_of, nominal
from drivers.vivid900.geometry.lenses import LENSES, MODES
from drivers.vivid900.geometry.triangulation import pitch_of
from restore.scan import RangeScan

MAX_SAMPLES = 2000  # of a shot: enough for the three unknowns of its plane and the few of the body
AS_SCANNED = "give scan folders as `planish scan` stores them"


def plate_shot(scan: RangeScan, board: Board, *, front_mm: float | None = None) -> PlateShot:
    """Measure the board in a scan, or a bare plate that fills the image.

    A plate is bare when no marker is found. The pitch is recomputed from the points with the calibration that is stored
    in the scan's provenance.
    front_mm: as in PlateShot.
    Raises SettingsError for a scan whose provenance is incomplete, or that was merged from several distances.
    """
    calibration = _calibration_used(scan)
    try:
        mode, distance = MODES[scan.provenance["mode"]], float(scan.provenance["distance_mm"])
    except (KeyError, TypeError, ValueError) as error:
        raise SettingsError(f"the scan does not say how it was taken: {error}", AS_SCANNED) from error
    if len(set(scan.provenance.get("distances_mm", []))) > 1:
        raise SettingsError("the scan is merged from several distances", "calibrate from captures at one distance each")
    if scan.points.shape[:2] != (mode.rows, mode.cols):
        raise SettingsError(f"the scan is not a grid of {mode.rows}×{mode.cols} samples", AS_SCANNED)
    detected = None if scan.texture is None else detect_board(scan.texture, board)
    on_plate = scan.measured if detected is None else scan.measured & detected.area(scan.texture_xy)
    some = np.flatnonzero(on_plate)
    some = some[:: max(len(some) // MAX_SAMPLES, 1)]
    pitch = pitch_of(scan.points, calibration, mode, distance).ravel()[some]
    shot = PlateShot(scan.texture_xy.reshape(-1, 2)[some], pitch, mode, distance, front_mm=front_mm)
    return shot if detected is None else replace(shot, pixels=detected.pixels, on_board=detected.on_board)


def nominal_of_scans(scans: Sequence[RangeScan]) -> Calibration:
    """Return the manual's figures for the body and lens of all the scans.

    Raises SettingsError when they are not of one body and lens, or `scans` is empty.
    """
    seen = {_calibration_used(scan) for scan in scans}
    if len({(used.lens, used.body, used.lens_serial) for used in seen}) != 1:
        raise SettingsError("the scans are not all of one body and lens", "calibrate each lens on each body by itself")
    used = seen.pop()
    return nominal(LENSES[used.lens], body=used.body, lens_serial=used.lens_serial)


def _calibration_used(scan: RangeScan) -> Calibration:
    if "calibration" not in scan.provenance:
        raise SettingsError("the scan does not say by which calibration its points were made", AS_SCANNED)
    return calibration_of(scan.provenance["calibration"], "the calibration in the scan")
