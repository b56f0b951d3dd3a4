"""Checks that all views show one page, bent alike, and one card.

The page is measured in patches. A view in which few of them are found shows another page, or the page where it no
longer lies; one in which they are found, but not where the others put them, shows it bent otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from restore.camera.photo_camera import PhotoCamera
from restore.findings import Finding
from restore.numerics.robust import MAJORITY
from restore.photo.photograph import Photograph
from restore.photo.pose import FOCAL_SPREAD
from restore.photogrammetry.cameras.align import MIN_MARKERS, MIN_VIEWS, views_that_agree
from restore.photogrammetry.cameras.bundle import ROUGHLY, Adjusted, Tracks, adjust
from restore.photogrammetry.cameras.card import ScaleCard, detect_markers
from restore.photogrammetry.cameras.sharpness import Sharpness, sharpness
from restore.photogrammetry.cameras.sparse import BLURRED_PX, SAME_FOCAL, SIDE
from restore.photogrammetry.errors import CardApart, Mirrored, NoPage, TooFewViews, ViewsApart
from restore.report import ScaleReport
from restore.scan import Bytes, Floats, Ints, Mask

MIN_FRACTION = 0.3  # of the patches that most views show: half a page under a hand leaves more
MAX_RATIO = 4.0  # of a view's residuals to most views', each over its own uncertainty
FREE_SHIFT = 0.05  # standard deviation of a principal point of which nothing is known, in widths of the picture
SAME_CENTRE = 0.01  # of the width: stabilisation shifts a principal point by a tenth of it
MAX_CARD_MM = 0.3  # rms of the markers about the flat card: ten times what they are off in five views
WRONG_CARD_MM = 1.0  # a strip of paper that is not flat bends by that much; beyond, the cameras are wrong


def check_found(found: Mask, in_frame: Mask, views: Sequence[int]) -> None:
    """Raise ViewsApart, naming views that show much less of the page.

    Most views (v,) show more.
    found, in_frame: (v, n), True where a patch is found, and where it lies within the picture.
    """
    known = found.any(axis=0)
    fractions = (found & known).sum(axis=1) / np.maximum((in_frame & known).sum(axis=1), 1)
    _raise_for(views, fractions < MIN_FRACTION * np.median(fractions), Finding.of("other_page"))


def check_residuals(residuals: Floats, sigma: Floats, view: Ints, views: Sequence[int]) -> None:
    """Raise ViewsApart, naming views with much larger residuals than most.

    residuals: (m, 2) pixels.
    sigma: (m,), their standard deviations.
    view: (m,), the row of `views` (v,) that each belongs to.
    """
    medians = _medians(residuals, sigma, view, len(views))
    _raise_for(views, medians > MAX_RATIO * np.median(medians), Finding.of("other_shape"))


def check_optics(adjusted: Adjusted, tracks: Tracks, views: Sequence[int]) -> None:
    """Raise ViewsApart, naming views (v,) with another zoom or crop.

    Their tracks support focal lengths that differ as only zooms do, or principal points that differ as only crops do:
    whichever of the two explains them better.
    """
    start = adjusted.cameras, adjusted.points, tracks
    freed = (
        adjust(*start, breathing=FOCAL_SPREAD, settled=ROUGHLY),
        adjust(*start, shifting=FREE_SHIFT, settled=ROUGHLY),
    )
    better = min(freed, key=lambda one: one.sigma0)
    before, after = (_medians(one.residuals, tracks.sigma, tracks.view, len(views)) for one in (adjusted, better))
    lenses = np.stack([camera.vector[6:9] for camera in better.cameras])
    longer = np.log(lenses[:, 0])
    by = np.expm1(longer - np.median(longer))
    off = np.linalg.norm(lenses[:, 1:] - np.median(lenses[:, 1:], axis=0), axis=1) / better.cameras[0].size[0]
    apart = {}
    # If that was it, most of its residuals are gone.
    for row in np.flatnonzero(after < MAJORITY * before).tolist():
        if abs(by[row]) > SAME_FOCAL:
            apart[views[row]] = Finding.of("zoomed", change=by[row])
        elif off[row] > SAME_CENTRE:
            apart[views[row]] = Finding.of("cropped", shift=off[row])
    if apart:
        raise ViewsApart(apart)


def _medians(residuals: Floats, sigma: Floats, view: Ints, views: int) -> Floats:
    """Return the median normalised residual of each view, (v,).

    residuals: (m, 2), over their standard deviations sigma (m,). 0 where a view has none.
    """
    errors = np.linalg.norm(residuals, axis=1) / sigma
    return np.array([np.median(errors[view == row]) if (view == row).any() else 0.0 for row in range(views)])


def within(cameras: Sequence[PhotoCamera], points: Floats) -> Mask:
    """Return which points are within the pictures of cameras.

    points: (n, 3). Returns (v, n) bool.
    """
    inside = [
        ((pixels > 0) & (pixels < np.array(camera.size) - 1)).all(axis=1)
        for camera, pixels in ((camera, camera.project(points)) for camera in cameras)
    ]
    return np.stack(inside)


def without(failed: Mapping[int, Finding], apart: ViewsApart, left: int, names: Sequence[str]) -> dict[int, Finding]:
    """Return the views that failed, and those apart.

    Raises TooFewViews when fewer than three would be left.
    """
    both = {**failed, **apart.reasons}
    if left - len(apart.reasons) < MIN_VIEWS:
        raise TooFewViews(
            f"{left - len(apart.reasons)} photographs show one page that lies still, and {MIN_VIEWS} are needed: "
            + "; ".join(f"{names[view]}: {why.text}" for view, why in both.items()),
            "photograph one page, and move neither it nor the card from the first photograph to the last",
        ) from apart
    return both


def _raise_for(views: Sequence[int], apart: Mask, why: Finding) -> None:
    if apart.any():
        raise ViewsApart({views[row]: why for row in np.flatnonzero(apart).tolist()})


def with_blur(fault: NoPage, photographs: Sequence[Photograph]) -> NoPage:
    """The fault, with the names of the photographs that are blurred when there are any."""
    names = [one.name for one in photographs if _sharpness_of(one).blur > BLURRED_PX]
    if not names:
        return fault
    return NoPage(
        f"{fault}; blurred: {', '.join(names)}", "focus on the page, hold the camera still, and photograph it again"
    )


def _sharpness_of(photograph: Photograph) -> Sharpness:
    grey = cv2.cvtColor(photograph.image, cv2.COLOR_RGB2GRAY)
    ratio = min(1.0, SIDE / max(grey.shape))
    return sharpness(cv2.resize(grey, None, fx=ratio, fy=ratio, interpolation=cv2.INTER_AREA))


def find_markers(photographs: Sequence[Photograph], card: ScaleCard) -> dict[int, Mapping[int, Floats]]:
    """Index of the photograph → marker → pixel (2,) of its centre.

    Raises Mirrored, naming the photographs, when the card is only found in their mirror image.
    """
    seen = {number: detect_markers(photograph.image, card) for number, photograph in enumerate(photographs)}
    mirrored = [
        photographs[number].name
        for number, markers in seen.items()
        if len(markers) < MIN_MARKERS <= len(detect_markers(_flipped(photographs[number].image), card))
    ]
    if mirrored:
        raise Mirrored(
            f"mirrored: {', '.join(mirrored)}", "flip them left to right, or switch mirroring off in the camera"
        )
    return seen


def _flipped(image: Bytes) -> Bytes:
    return np.ascontiguousarray(image[:, ::-1])


def card_findings(
    photographs: Sequence[Photograph], seen: Mapping[int, Mapping[int, Floats]], scale: ScaleReport
) -> tuple[Finding, ...]:
    """Return the findings about the card.

    photographs: with their cameras.
    seen: centres (2,) of the markers seen in each, by its index.
    scale: the scale found.
    Raises CardApart when the markers are where no card has them.
    """
    cameras = {number: photograph.camera for number, photograph in enumerate(photographs) if photograph.camera}
    showing = [number for number in cameras if len(seen.get(number, {})) >= MIN_MARKERS]
    if len(showing) < MIN_VIEWS:
        return (Finding.of("card_in_few"),)
    agreeing = views_that_agree(cameras, seen)
    if len(agreeing) < MIN_VIEWS:
        raise CardApart(
            "no three photographs agree where the card lies next to the page: page or card was moved, or photographs "
            "were cropped or zoomed",
            "leave page and card where they are, and give the photographs as the camera wrote them",
        )
    off = scale.get("residual_mm", 0.0)
    if off > WRONG_CARD_MM:
        raise CardApart(
            f"the markers of the card are {off:.1f} mm off their places: the photographs do not agree about it",
            "give photographs that are neither cropped nor zoomed, and lay the card flat",
        )
    found = []
    apart = [photographs[number].name for number in showing if number not in agreeing]
    if apart:
        found.append(Finding.of("card_moved", names=", ".join(apart)))
    if off > MAX_CARD_MM:
        found.append(Finding.of("card_uneven", distance_mm=off))
    return tuple(found)
