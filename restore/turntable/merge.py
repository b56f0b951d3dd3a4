"""Merge the views of a turntable: what one view misses, another has seen.

The range grid of one view stays as it is, samples, rays and picture. Where it has a hole (the laser's shadow, ink that
swallowed the light) the surfaces of the others are looked at along the very same rays. So whatever relies on the rays
of one shot goes on working, and the picture needs no seams: the camera saw what only the laser missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from restore.errors import BadInput
from restore.scan import Floats, RangeScan
from restore.turntable.axis import RotationAxis
from restore.turntable.look import Outlook
from restore.turntable.register import register
from restore.turntable.roll import roll

MAX_RESIDUAL = 1 / 3  # of a sample's spacing: noise stays well below it, a page that moved does not
LEAST_OVERLAP = 0.2  # of the samples of the smaller view
ONE_SIGMA = 68.27  # percentile of absolute values
WORTH_TURNING = 1.1  # times as large a page: perspective alone makes differences of a few hundredths
QUARTER_DEG = 90.0


@dataclass(frozen=True)
class View:
    """What became of one view.

    turn_deg     what the stage had turned, −180 to 180.
    residual_mm  distance from the first view's surface below which 68 % of the shared samples lie; None without any.
    moved_mm     how far registration moved the middle of the view from where the stage put it.
    filled       samples of the reference that it filled.
    refused      why it was left out; empty when it was not.
    """

    turn_deg: float
    residual_mm: float | None
    moved_mm: float
    filled: int = 0
    refused: str = ""


@dataclass(frozen=True, eq=False)
class MergedViews:
    """One scan made of several.

    scan       the reference view, its holes filled as far as others saw them, rolled upright by quarters of a turn.
    reference  its place among the views.
    views      what became of each, the reference among them.
    """

    scan: RangeScan
    reference: int
    views: tuple[View, ...]

    @property
    def warnings(self) -> list[str]:
        """One line for each view that was left out."""
        return [f"the view at {view.turn_deg:g}° was left out: {view.refused}" for view in self.views if view.refused]


def merge_views(
    scans: Sequence[RangeScan], turns_deg: Sequence[float], axis: RotationAxis, *, reference: int | None = None
) -> MergedViews:
    """Merge shots of one page that a turntable turned between them.

    turns_deg  what the stage had turned before each shot; the page comes out upright as it stood nearest to 0°.
    reference  the view to be completed; when None that nearest to 0°, or one that shows more of the page in one piece.
    A view that does not fit is left out, with a warning.
    Raises BadInput when there is no view, or a view is not one shot of a scanner, NotEnoughSurface for an empty one.
    """
    if not scans or len(scans) != len(turns_deg):
        raise BadInput(f"{len(scans)} views and {len(turns_deg)} angles", "give one angle for each view")
    outlooks = [Outlook(scan) for scan in scans]
    turns = [(turn + 180.0) % 360.0 - 180.0 for turn in turns_deg]
    base = int(np.argmin(np.abs(turns)))
    placed = [
        (View(turn, 0.0, 0.0), np.eye(4))
        if index == base
        else _place(outlooks[index], outlooks[base], axis.turn(turns[base] - turn), turn)
        for index, turn in enumerate(turns)
    ]
    views, motions = [view for view, _ in placed], [motion for _, motion in placed]
    used = [index for index, view in enumerate(views) if not view.refused]
    if reference is None or reference not in used:
        reference = _sees_most(outlooks, used, base)
    chosen, back = outlooks[reference], np.linalg.inv(motions[reference])
    layers = []
    for index in used:
        if index != reference:
            layers.append(chosen.drawn(chosen.at(outlooks[index], back @ motions[index])))
            views[index] = replace(views[index], filled=chosen.holes(layers[-1]))
    told = [{key: value for key, value in vars(view).items() if value != ""} for view in views]
    provenance = {**chosen.scan.provenance, "reference": reference, "views": told}
    scan = replace(chosen.scan, points=chosen.filled(layers), provenance=provenance)
    return MergedViews(roll(scan, _quarters(motions[reference])), reference, tuple(views))


def _place(view: Outlook, base: Outlook, start: Floats, turn: float) -> tuple[View, Floats]:
    """Register a view with the base: what came of it, and the motion (4, 4) from its frame to that of the base."""
    motion = register(view.scan, base.scan, start, base.spacing)
    middle = np.append(view.scan.points[view.scan.measured].mean(axis=0), 1.0)
    moved = float(np.linalg.norm(((motion - start) @ middle)[:3]))
    apart = base.apart(base.at(view, motion))
    residual = float(np.percentile(np.abs(apart), ONE_SIGMA)) if apart.size else None
    share = apart.size / min(int(outlook.scan.measured.sum()) for outlook in (view, base))
    refused = ""
    if residual is None or share < LEAST_OVERLAP:
        refused = f"it shares {share:.0%} of its samples with the view nearest to 0°"
    elif residual > MAX_RESIDUAL * base.spacing:
        refused = f"its surface lies {residual:.2f} mm off, so the page moved or the axis is wrong"
    return View(turn, residual, moved, refused=refused), motion


def _sees_most(outlooks: Sequence[Outlook], used: Sequence[int], base: int) -> int:
    """The view whose page, in one piece, is largest: a shadow cuts it in two. The base, unless one is much better."""
    sizes = {index: outlooks[index].sheet() for index in used}
    best = max(sizes, key=sizes.__getitem__)
    return best if sizes[best] > WORTH_TURNING * sizes[base] else base


def _quarters(motion: Floats) -> int:
    """Quarters of a turn, counter-clockwise, by which a motion rolls the picture."""
    return round(float(np.degrees(np.arctan2(motion[1, 0], motion[0, 0]))) / QUARTER_DEG)
