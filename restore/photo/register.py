"""Registers a photograph to the scanned surface, or says why not."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.camera.photo_camera import PARAMETERS, PhotoCamera, project_with_jacobian
from restore.photo.blur import relative_blur
from restore.photo.dense import FLOOR, GRID, WINDOW, Shifts, measure
from restore.photo.features import Features, detect, match, reference_features
from restore.photo.photograph import Photograph
from restore.photo.pose import FOCAL_SPREAD, LADDER, LOOSE, find_pose, prior_deviation, refine, reprojection_errors
from restore.photo.reference import Reference
from restore.scan import Bytes, Floats

# Pixels: features are found where the print is about as coarse as the scanner's image of it. SIFT itself doubles a
# picture before it looks, so that the last side finds what a picture of 4,400 pixels shows.
SIDES = (800, 1600, 2200)
DENSE_SIDE = 3200  # of the copy on which shifts are measured and sharpness is checked
MIRROR_SIDE = SIDES[1]
MIN_INLIERS = 8  # no more agree by chance than that, and what they agree on is proved on the whole surface
MIRRORED_INLIERS = 16  # for a reason that is not proved
REFINEMENTS = 6
COARSE_STEPS = 1  # with the pyramid; then it could only mislead
BEHIND_STEP = 16  # reference pixels
SETTLED = 0.02  # reference pixels that a refinement moves the page by: nothing more to gain
SIGMA = 0.1  # reference pixels: how well a shift is measured
KNOWN_FOCAL = 0.1  # relative; EXIF stores whole millimetres, and focusing changes the length
MAX_REPROJECTION_ERROR = 1.0  # reference pixels: more is a wrong match, as where a window spans a crease
MIN_PLACES = 14  # as many unknowns has a camera
MIN_ALIKE = 0.6  # of the places with print: the rest is glare, shadow, fingers; of another page, up to half are
MAX_BLUR = 0.9  # reference pixels, by which it spreads print more: the scanner itself spreads it by half as much
MAX_RESIDUAL = 0.5  # reference pixels, rms: a page that was moved or bent since has more, and so has an uncertain pose
OVERLAP = WINDOW / GRID  # neighbouring windows have most pixels, and so errors, in common
MIN_COVERAGE = 0.1  # of the page: less is hardly worth its seams


ANOTHER = "check that it shows this page, sharply and in full"
STILL = "focus on the page, hold the camera still (a stand, more light, a shorter exposure), and photograph it again"
AGAIN = "photograph the page from above so that it fills the image, and do not move it between scan and photograph"


class Refused(Exception):
    """The photograph cannot be used reliably.

    The message is the reason, `hint` what to do now.
    final: it shows the page, and no other attempt to register it would change the reason.
    """

    def __init__(self, reason: str, hint: str = ANOTHER, *, final: bool = False) -> None:
        super().__init__(reason)
        self.hint, self.final = hint, final


@dataclass(frozen=True, eq=False)
class Registration:
    """Photograph in its place.

    camera: the camera that took it.
    residual_px: rms residual between print and print, in the photograph's pixels.
    uncertainty_px: rms over the page of the standard deviation of where a point is seen, in the photograph's pixels.
    alike: fraction of the printed places that look the same and are where the camera says.
    coverage: fraction of the page that the photograph shows.
    scale: the photograph's pixels to one of the reference.
    """

    camera: PhotoCamera
    residual_px: float
    uncertainty_px: float
    match_fraction: float
    coverage: float
    scale: float


def register(reference: Reference, photograph: Photograph) -> Registration:
    """Find the camera of a photograph.

    Raises Refused when it does not reliably show the page of the reference.
    """
    grey = cv2.cvtColor(photograph.image, cv2.COLOR_RGB2GRAY)
    if cv2.meanStdDev(grey)[1].item() < FLOOR:
        raise Refused("the photograph is blank", "look at it, and take it again with light and without the lens cap")
    ours, refused = reference_features(reference), Refused("")
    large = _shrunk(grey, DENSE_SIDE)
    for side in SIDES:
        small = _shrunk(large, side)
        focal = photograph.focal_px and photograph.focal_px * small.shape[1] / grey.shape[1]
        camera, inliers = _posed(reference, ours, small, focal)
        try:
            return _certain(reference, large, camera, inliers, grey.shape[::-1], photograph.focal_px)
        except Refused as refusal:
            refused = refusal
        if refused.final or side >= max(grey.shape):
            break
    if not refused.final and _mirrored(reference, ours, large):
        raise Refused("the photograph is mirrored", "flip it left to right, or switch mirroring off in the camera")
    raise refused


def _certain(
    reference: Reference,
    grey: Bytes,
    camera: PhotoCamera,
    inliers: int,
    size: tuple[int, ...],
    focal_px: float | None,
) -> Registration:
    """Return the registration that a first pose leads to.

    The pose is of a smaller copy, in pixels of the photograph.
    size: (w, h), of the photograph.
    Raises Refused when the registration is not reliable.
    """
    if inliers < MIN_INLIERS:
        raise Refused(f"the photograph does not show this page: {inliers} features agree, {MIN_INLIERS} are needed")
    if _from_behind(reference, camera):  # where a mirrored picture would have been taken, through the paper
        raise Refused("the photograph shows the page from behind", "photograph the side that was scanned")
    camera, shifts = _refined(reference, grey, camera.scaled((size[0], size[1])), focal_px)
    _insist_on_sharpness(reference, grey, camera, shifts)
    found = _registration(reference, camera, shifts)
    _insist(found, reference)
    return found


def _mirrored(reference: Reference, ours: Features, grey: Bytes) -> bool:
    """Whether the photograph shows the page when it is mirrored."""
    flipped = np.ascontiguousarray(_shrunk(grey, MIRROR_SIDE)[:, ::-1])
    camera, inliers = _posed(reference, ours, flipped, None)
    return inliers >= MIRRORED_INLIERS and not _from_behind(reference, camera)


def _from_behind(reference: Reference, camera: PhotoCamera) -> bool:
    """Return whether the camera would see the page mirrored.

    The scanner is the reference.
    """
    points = reference.points[::BEHIND_STEP, ::BEHIND_STEP].astype(np.float64)
    where = camera.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2)
    right, down = np.diff(where, axis=1)[:-1], np.diff(where, axis=0)[:, :-1]
    turn = right[..., 0] * down[..., 1] - right[..., 1] * down[..., 0]
    return bool(np.nanmedian(turn) < 0) if np.isfinite(turn).any() else False


def _shrunk(grey: Bytes, side: int) -> Bytes:
    ratio = min(1.0, side / max(grey.shape))
    size = (round(grey.shape[1] * ratio), round(grey.shape[0] * ratio))
    smaller: Bytes = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    return smaller


def _posed(reference: Reference, ours: Features, grey: Bytes, focal_px: float | None) -> tuple[PhotoCamera, int]:
    """Return the camera that features support, and how many do.

    grey: (h, w), a small copy of the photograph.
    """
    side, size = max(grey.shape), (grey.shape[1], grey.shape[0])
    matches = match(ours, detect(grey))
    points = reference.at(matches.reference)
    on_page = np.isfinite(points[:, 0])
    points, pixels = points[on_page], matches.photograph[on_page]
    ladder = [fraction * side for fraction in LADDER]
    camera, inliers = find_pose(points, pixels, size, [focal_px, *ladder] if focal_px else ladder)
    for straight in (True, False):
        if inliers.sum() >= MIN_INLIERS:
            camera = refine(camera, points[inliers], pixels[inliers], 1.0, straight=straight)
            inliers = reprojection_errors(camera, points, pixels) < LOOSE * side / 2
    return camera, int(inliers.sum())


def _refined(
    reference: Reference, grey: Bytes, camera: PhotoCamera, focal_px: float | None
) -> tuple[PhotoCamera, Shifts]:
    focal_spread = KNOWN_FOCAL if focal_px else FOCAL_SPREAD
    for step in range(REFINEMENTS):
        shifts = measure(reference, grey, camera, near=step >= COARSE_STEPS)
        points = reference.at(shifts.moved)
        good = shifts.alike & np.isfinite(points[:, 0])
        if good.sum() < MIN_PLACES:
            raise Refused("the photograph does not show this page: its print is another")
        before = camera.project(points[good])
        camera = refine(
            camera,
            points[good],
            shifts.pixels[good],
            SIGMA * shifts.scale,
            focal_px=focal_px,
            focal_spread=focal_spread,
        )
        if (
            step >= COARSE_STEPS
            and np.sqrt(np.mean((camera.project(points[good]) - before) ** 2)) < SETTLED * shifts.scale
        ):
            break
    return camera, measure(reference, grey, camera, near=True)


def _registration(reference: Reference, camera: PhotoCamera, shifts: Shifts) -> Registration:
    points = reference.at(shifts.moved)
    error = reprojection_errors(camera, np.nan_to_num(points, nan=np.inf), shifts.pixels)
    good = shifts.alike & (error < MAX_REPROJECTION_ERROR * shifts.scale)
    if good.sum() < MIN_PLACES:
        raise Refused("the photograph does not show this page: its print is another")
    residual = float(np.sqrt(np.mean(error[good] ** 2)))
    page = reference.points[reference.page][:: max(1, int(reference.page.sum()) // 1000)].astype(float)
    uncertain = _uncertainty(camera, points[good], residual / np.sqrt(2), page)
    return Registration(camera, residual, uncertain, float(good.mean()), shifts.coverage, shifts.scale)


def _uncertainty(camera: PhotoCamera, points: Floats, sigma: float, page: Floats) -> float:
    """The rms standard deviation in pixels of where points on the page (m, 3) are seen.

    It follows from the adjustment to points (n, 3) whose pixels have the standard deviation sigma.
    """
    _, slopes = project_with_jacobian(camera.vector, points)
    deviation = prior_deviation(camera.focal_px, camera.size)
    rows = slopes.reshape(-1, PARAMETERS) / (max(sigma, 1e-3) * OVERLAP)
    priors = np.eye(PARAMETERS)[6:] / deviation[:, None]
    scale = np.maximum(np.linalg.norm(np.concatenate([rows, priors]), axis=0), 1e-12)
    normal = np.concatenate([rows, priors]) / scale
    covariance = np.linalg.pinv(normal.T @ normal)
    _, at_page = project_with_jacobian(camera.vector, page)
    at_page = at_page / scale
    return float(np.sqrt(np.mean(np.einsum("nij,jk,nik->n", at_page, covariance, at_page))))


def _insist_on_sharpness(reference: Reference, grey: Bytes, camera: PhotoCamera, shifts: Shifts) -> None:
    """Raise Refused when a photograph is less sharp than the scanner's image."""
    if shifts.scale <= 1.0 or shifts.alike.mean() < MIN_ALIKE:  # of another page, its sharpness says nothing
        return
    blur = relative_blur(reference, grey, camera)
    if blur > MAX_BLUR:
        spread = blur * reference.pixel_mm
        raise Refused(
            f"the photograph is blurred: print is spread by {spread:.1f} mm of paper more than in the scanner's image",
            STILL,
            final=True,
        )


def _insist(found: Registration, reference: Reference) -> None:
    if found.match_fraction < MIN_ALIKE:
        raise Refused(
            f"the photograph does not show this page: only {found.match_fraction:.0%} of the print looks the same"
        )
    if found.residual_px > MAX_RESIDUAL * found.scale:
        raise Refused(
            f"the photograph does not fit the surface: {found.residual_px:.1f} pixels rms are left; "
            "was the page moved between scan and photograph?",
            AGAIN,
        )
    if found.uncertainty_px > MAX_RESIDUAL * found.scale:
        off = found.uncertainty_px / found.scale
        raise Refused(
            "the photograph and the scan have too little print in common, or all of it in one corner, to locate the "
            f"rest of the page: {_off(off, reference.pixel_mm)}",
            AGAIN,
        )
    if found.coverage < MIN_COVERAGE:
        raise Refused(f"the photograph shows only {found.coverage:.0%} of the page", AGAIN, final=True)
    if found.scale <= 1.0:
        raise Refused("the photograph is coarser than the scanner's own image", AGAIN, final=True)


def _off(pixels: float, pixel_mm: float) -> str:
    """Return how far a page may be off.

    Errors larger than WINDOW, two lines of print, are all alike.
    """
    return f"it may be {pixels * pixel_mm:.1f} mm off" if pixels < WINDOW else "it may be anywhere"
