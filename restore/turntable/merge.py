"""Merge the views of a turntable: the holes of one view are filled from the others.

The range grid of one view, the reference, is kept with its samples, rays and picture. Where it has a hole (the laser's
shadow, ink that absorbed the laser) the surfaces of the other views are rendered along its own rays. The result is a
scan of one camera like any other, and its picture has no seams.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from restore.errors import BadInput
from restore.findings import Finding
from restore.runtime.arguments import checks_types
from restore.scan import Floats, RangeScan
from restore.turntable.axis import RotationAxis
from restore.turntable.register import register
from restore.turntable.rotate import rotate_quarters
from restore.turntable.view import RangeView

MAX_RESIDUAL = 1 / 3  # of a sample's spacing: noise stays well below it, a page that moved does not
MIN_OVERLAP = 0.2  # of the samples of the smaller view
ONE_SIGMA_PERCENTILE = 68.27  # percentile of absolute values
# Ratio of the page's samples to those in the view nearest to 0°: perspective alone changes it by a few hundredths.
MIN_SIZE_GAIN = 1.1
QUARTER_DEG = 90.0


@dataclass(frozen=True)
class ViewReport:
    """The result of registering one view.

    turn_deg     angle of the stage, −180 to 180.
    residual_mm  distance from the first view's surface below which 68 % of the shared samples lie; None without any.
    moved_mm     distance by which registration moved the centroid of the view away from its initial place.
    filled       number of samples of the reference that it filled.
    refused      reason for which it was left out; empty when it was used.
    """

    turn_deg: float
    residual_mm: float | None
    moved_mm: float
    filled: int = 0
    refused: str = ""


@dataclass(frozen=True, eq=False)
class MergedViews:
    """One scan merged from several views.

    scan       the reference view, its holes filled from the others, rotated upright by quarters of a turn.
    reference  its index among the views.
    views      a report of each, the reference included.
    """

    scan: RangeScan
    reference: int
    views: tuple[ViewReport, ...]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """One for each view that was left out."""
        left_out = (view for view in self.views if view.refused)
        return tuple(Finding.of("view_left_out", turn_deg=view.turn_deg, reason=view.refused) for view in left_out)


@checks_types
def merge_views(
    scans: Sequence[RangeScan], turns_deg: Sequence[float], axis: RotationAxis, *, reference: int | None = None
) -> MergedViews:
    """Merge captures of one page that a turntable rotated between them.

    A view that cannot be registered is left out, with a finding. `examples/turntable.py` merges views.
    turns_deg: angle of the turntable at each capture; the merged page is upright as in the view nearest to 0°.
    reference: index of the view to complete; None chooses that nearest to 0°, or one with clearly more of the page.
    Returns the `scan`, upright, the index of the `reference`, a report of each of the `views` and `findings`.
    Raises BadInput when `scans` is empty, or a view is not one capture of a scanner, NotEnoughSurface for an empty one.
    """
    if not scans or len(scans) != len(turns_deg):
        raise BadInput(f"{len(scans)} views and {len(turns_deg)} angles", "give one angle for each view")
    range_views = [RangeView(scan) for scan in scans]
    turns = [(turn + 180.0) % 360.0 - 180.0 for turn in turns_deg]
    base = int(np.argmin(np.abs(turns)))
    registered = [
        (ViewReport(turn, 0.0, 0.0), np.eye(4))
        if index == base
        else _register(range_views[index], range_views[base], axis.turn(turns[base] - turn), turn)
        for index, turn in enumerate(turns)
    ]
    views, motions = [view for view, _ in registered], [motion for _, motion in registered]
    used = [index for index, view in enumerate(views) if not view.refused]
    if reference is None or reference not in used:
        reference = _most_complete(range_views, used, base)
    reference_view, to_reference = range_views[reference], np.linalg.inv(motions[reference])
    layers = []
    for index in used:
        if index != reference:
            layer = reference_view.render_inverse_depth(range_views[index], to_reference @ motions[index])
            layers.append(reference_view.subtract_offset(layer))
            views[index] = replace(views[index], filled=reference_view.count_fillable(layers[-1]))
    view_reports = [{key: value for key, value in vars(view).items() if value != ""} for view in views]
    provenance = {**reference_view.scan.provenance, "reference": reference, "view_registrations": view_reports}
    scan = replace(reference_view.scan, points=reference_view.fill_holes(layers), provenance=provenance)
    return MergedViews(rotate_quarters(scan, _quarter_turns(motions[reference])), reference, tuple(views))


def _register(view: RangeView, base: RangeView, initial: Floats, turn: float) -> tuple[ViewReport, Floats]:
    """Register a view with the base.

    Returns its report, and the rigid motion (4, 4) from its frame to that of the base.
    """
    motion = register(view.scan, base.scan, initial, base.spacing)
    centroid = np.append(view.scan.points[view.scan.measured].mean(axis=0), 1.0)
    moved = float(np.linalg.norm(((motion - initial) @ centroid)[:3]))
    distances = base.surface_distance(base.render_inverse_depth(view, motion))
    residual = float(np.percentile(np.abs(distances), ONE_SIGMA_PERCENTILE)) if distances.size else None
    fraction = distances.size / min(int(range_view.scan.measured.sum()) for range_view in (view, base))
    refused = ""
    if residual is None or fraction < MIN_OVERLAP:
        refused = f"only {fraction:.0%} of its samples are in the view nearest to 0°"
    elif residual > MAX_RESIDUAL * base.spacing:
        refused = f"its surface lies {residual:.2f} mm off, so the page moved or the axis is wrong"
    return ViewReport(turn, residual, moved, refused=refused), motion


def _most_complete(range_views: Sequence[RangeView], used: Sequence[int], base: int) -> int:
    """Return the index of the view with the largest connected page.

    The base unless another is clearly larger. The laser's shadow may divide the page in one view and not in another.
    """
    sizes = {index: range_views[index].sheet_samples() for index in used}
    best = max(sizes, key=sizes.__getitem__)
    return best if sizes[best] > MIN_SIZE_GAIN * sizes[base] else base


def _quarter_turns(motion: Floats) -> int:
    """Return the counter-clockwise quarter turns nearest to a motion.

    motion: (4, 4), its rotation about the optical axis.
    """
    return round(float(np.degrees(np.arctan2(motion[1, 0], motion[0, 0]))) / QUARTER_DEG)
