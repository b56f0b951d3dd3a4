"""Stored scans of plates, read as what a calibration needs of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivers.scanner import SettingsError
from drivers.vivid900.board import Board, sight_board
from drivers.vivid900.bundle import PlateShot
from drivers.vivid900.calibration import Calibration, calibration_of, nominal
from drivers.vivid900.lenses import LENSES, MODES
from drivers.vivid900.triangulation import pitch_of
from restore.scan import RangeScan

MOST_SAMPLES = 2000  # of a shot: the three unknowns of its plane and the smooth ones of the body need no more
AS_SCANNED = "give scan folders as `planish scan` stores them"


def plate_shot(scan: RangeScan, board: Board, *, front_mm: float | None = None) -> PlateShot:
    """What a scan shows of a board, or of a bare plate that fills the picture when no marker is seen.

    The pitch comes back from the points, by the calibration that made them and that the scan tells with them.
    front_mm  as in PlateShot.
    Raises SettingsError for a scan that does not tell how it was taken, or was merged from several distances.
    """
    calibration = _told(scan)
    try:
        mode, distance = MODES[scan.provenance["mode"]], float(scan.provenance["distance_mm"])
    except (KeyError, TypeError, ValueError) as error:
        raise SettingsError(f"the scan does not tell how it was taken: {error}", AS_SCANNED) from error
    if len(set(scan.provenance.get("distances_mm", []))) > 1:
        raise SettingsError("the scan is merged from several distances", "calibrate from shots at one distance each")
    if scan.points.shape[:2] != (mode.rows, mode.cols):
        raise SettingsError(f"the scan is no grid of {mode.rows}×{mode.cols} samples", AS_SCANNED)
    sighted = None if scan.texture is None else sight_board(scan.texture, board)
    on_plate = scan.measured if sighted is None else scan.measured & sighted.area(scan.texture_xy)
    some = np.flatnonzero(on_plate)
    some = some[:: max(len(some) // MOST_SAMPLES, 1)]
    pitch = pitch_of(scan.points, calibration, mode, distance).ravel()[some]
    shot = PlateShot(scan.texture_xy.reshape(-1, 2)[some], pitch, mode, distance, front_mm=front_mm)
    return shot if sighted is None else replace(shot, pixels=sighted.pixels, on_board=sighted.on_board)


def body_of_scans(scans: Sequence[RangeScan]) -> Calibration:
    """The manual's figures for the body and lens that took all of the scans.

    Raises SettingsError when they are not of one body and lens, or there are none.
    """
    seen = {_told(scan) for scan in scans}
    if len({(told.lens, told.body, told.lens_serial) for told in seen}) != 1:
        raise SettingsError("the scans are not all of one body and lens", "calibrate each lens on each body by itself")
    told = seen.pop()
    return nominal(LENSES[told.lens], body=told.body, lens_serial=told.lens_serial)


def _told(scan: RangeScan) -> Calibration:
    if "calibration" not in scan.provenance:
        raise SettingsError("the scan does not tell by which calibration its points were made", AS_SCANNED)
    return calibration_of(scan.provenance["calibration"], "the calibration in the scan")
