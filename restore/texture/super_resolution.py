"""Super-resolution: several colour images of a page to a finer one.

They are shifted by fractions of a pixel. A pixel is the mean over its own area of the picture blurred by the lens.
Images with different subpixel shifts sample it at different positions, and together resolve more than one does. The
finer picture is the one from which the forward model (blur, shift, pixel area) predicts the images; it is found by
back-projection of the residuals (M. Irani, S. Peleg, "Improving resolution by image registration", CVGIP: Graphical
Models and Image Processing 53(3), 1991), a gradient descent on their squares and, with a small weight, on that of the
picture's own Laplacian: what the camera hardly lets through, it would otherwise raise with the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.runtime.arguments import checks_types
from restore.scan import Bytes, Floats, RangeScan

FACTOR = 2  # finer pixels to a pixel's side; the mean over a pixel's area removes finer detail
MIN_SHOTS = FACTOR**2  # one image for each finer pixel of a pixel
LENS_BLUR_PX = 0.35  # standard deviation of the lens's blur, in pixels of the images
ITERATIONS = 12  # further iterations amplify noise more than print
# Weight of the squared Laplacian relative to the residuals: print of 8 and 9 points is read better than without, and
# the picture is still nearer to the truth than one enlarged image by a third.
SMOOTHING = 0.01
# Larger shifts have parallax between the page's hills and hollows: 3 % of the shift at the scanner's 0.9 m, which up
# to here is less than a tenth of a pixel.
MAX_SHIFT_PX = 3.0
MIN_CORRELATION = 0.7  # of two images of one page: of small print half a pixel apart 0.85, of different pages below 0.5
# Mean resultant length of the subpixel phases of the shifts: 1 when all coincide, 0 when they are evenly spread.
MAX_PHASE_CONCENTRATION = 0.95
ECC_ITERATIONS, ECC_TOLERANCE = 100, 1e-6

Picture = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class SuperResolution:
    """Super-resolved image.

    image: (FACTOR · h, FACTOR · w, 3) uint8.
    maps: (n, 2, 3), affine from the first image's pixels to each's.
    """

    image: Bytes
    maps: Floats


@checks_types
def super_resolve(shots: Sequence[RangeScan]) -> RangeScan:
    """Return the first scan with the super-resolved texture of all.

    Raises BadInput as `super_resolve_images`. The texture is (h, w, 3).

    >>> import cv2
    >>> noise = np.random.default_rng(1).integers(0, 256, (256, 256, 3), np.uint8)
    >>> page = cv2.GaussianBlur(noise, (0, 0), 2.0) * np.uint8(2)
    >>> halves = [page[y : 240 + y : 2, x : 240 + x : 2] for x, y in ((0, 0), (0, 1), (1, 0), (1, 1))]
    >>> shots = [RangeScan(np.zeros((2, 2, 3)), picture, np.zeros((2, 2, 2))) for picture in halves]
    >>> super_resolve(shots).texture.shape
    (240, 240, 3)
    """
    if not shots:
        raise BadInput("no captures were given", "give two captures of the page or more")
    first = shots[0]
    images = [shot.texture for shot in shots if shot.texture is not None]
    if len(images) < len(shots) or first.texture is None:
        raise BadInput("a capture has no colour image", "leave it out")
    result = super_resolve_images(images)
    summary = {"captures": len(shots), "factor": FACTOR, "shifts_px": _shifts(result.maps, images[0]).round(3).tolist()}
    positions = first.texture_xy * FACTOR + (FACTOR - 1) / 2
    return replace(
        first, texture=result.image, texture_xy=positions, provenance={**first.provenance, "super_resolution": summary}
    )


def super_resolve_images(images: Sequence[Bytes]) -> SuperResolution:
    """Super-resolve images (h, w, 3) uint8 of the same page.

    Returns the picture and their registration. Raises BadInput when they are too few, of different sizes, of different
    pages, or their shifts too large or equal.
    """
    if len(images) < MIN_SHOTS:
        raise BadInput(f"{len(images)} captures are too few to see more than one does", f"take {MIN_SHOTS} or more")
    if len({image.shape for image in images}) > 1:
        raise BadInput("the captures are of different sizes", "take all captures with the same settings")
    maps = np.stack([registration(images[0], image, name=f"capture {i + 1}") for i, image in enumerate(images)])
    concentration = np.abs(np.exp(2j * np.pi * _shifts(maps, images[0])).mean(axis=0))
    if concentration.max() > MAX_PHASE_CONCENTRATION:
        raise BadInput("the captures lie on each other", "move page or scanner by half a pixel or so between captures")
    observed = [image.astype(np.float32) for image in images]
    picture = np.mean([_back_project(image, affine) for image, affine in zip(observed, maps, strict=True)], axis=0)
    # Next to ink and table back-projection overshoots: no pixel may be brighter than the images nearby.
    upper_bound = cv2.dilate(picture, np.ones((2 * FACTOR + 1, 2 * FACTOR + 1), np.uint8))
    for _ in range(ITERATIONS):
        residuals = [
            _back_project(image - _forward(picture, affine), affine)
            for image, affine in zip(observed, maps, strict=True)
        ]
        picture = np.minimum(picture + np.mean(residuals, axis=0) - SMOOTHING * _roughness(picture), upper_bound)
    return SuperResolution(np.clip(np.rint(picture), 0, 255).astype(np.uint8), maps)


def registration(reference: Bytes, image: Bytes, *, name: str = "a shot") -> Floats:
    """Return the affine map (2, 3), pixels, from the reference to an image, by ECC.

    G. Evangelidis, E. Psarakis, "Parametric image alignment using enhanced correlation coefficient maximization", IEEE
    TPAMI 30(10), 2008. Raises BadInput when the image does not show the same page, or the shift is too large.
    """
    grey, other = (cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for picture in (reference, image))
    (dx, dy), _ = cv2.phaseCorrelate(grey.astype(np.float64), other.astype(np.float64))
    start = np.array([[1, 0, dx], [0, 1, dy]], np.float32)
    ending = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, ECC_ITERATIONS, ECC_TOLERANCE)
    different_page = BadInput(
        f"{name} does not show the same page", "take all captures of one page, one after the other"
    )
    try:
        correlation, result = cv2.findTransformECC(grey, other, start, cv2.MOTION_AFFINE, ending)
    except cv2.error as error:
        raise different_page from error
    if correlation < MIN_CORRELATION:
        raise different_page
    corners = np.array([[x, y, 1.0] for x in (0, grey.shape[1]) for y in (0, grey.shape[0])])
    largest_shift = float(np.linalg.norm(corners @ result.T - corners[:, :2], axis=1).max())
    if largest_shift > MAX_SHIFT_PX:
        raise BadInput(
            f"{name} has moved by {largest_shift:.1f} pixels",
            f"move the page by less than {MAX_SHIFT_PX:g} between captures",
        )
    return np.asarray(result, np.float64)


def _shifts(maps: Floats, image: Bytes) -> Floats:
    """Return the shifts (n, 2) of the centre of the image, pixels."""
    middle = np.array([(image.shape[1] - 1) / 2, (image.shape[0] - 1) / 2, 1.0])
    return np.asarray(maps @ middle - middle[:2])


def _forward(picture: Picture, affine: Floats) -> Picture:
    """Return the image (h, w, 3) of the finer picture at an affine map (2, 3): forward model."""
    observed = cv2.GaussianBlur(picture, (0, 0), LENS_BLUR_PX * FACTOR)
    observed = cv2.blur(observed, (FACTOR, FACTOR))  # an even box is centred half a pixel up and left: hence FACTOR / 2
    size = picture.shape[1] // FACTOR, picture.shape[0] // FACTOR
    to_fine = _to_fine_pixels(FACTOR / 2) @ np.linalg.inv(_homogeneous(affine))
    return np.asarray(
        cv2.warpAffine(
            observed, to_fine[:2], size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE
        ),
        np.float32,
    )


def _back_project(image: Picture, affine: Floats) -> Picture:
    """Back-project an image or residual (h, w, 3) to finer pixels at an affine map (2, 3)."""
    size = image.shape[1] * FACTOR, image.shape[0] * FACTOR
    from_fine = _homogeneous(affine) @ np.linalg.inv(_to_fine_pixels((FACTOR - 1) / 2))
    return np.asarray(
        cv2.warpAffine(
            image, from_fine[:2], size, flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE
        ),
        np.float32,
    )


def _roughness(picture: Picture) -> Picture:
    """Return the Laplacian of the Laplacian of a picture (h, w, 3).

    It is half the gradient of the sum of its square.
    """
    return np.asarray(cv2.Laplacian(cv2.Laplacian(picture, cv2.CV_32F), cv2.CV_32F))


def _to_fine_pixels(middle: float) -> Floats:
    """Return the matrix (3, 3) from pixels of an image to finer ones.

    The centre of the first pixel is mapped to (middle, middle).
    """
    return np.array([[FACTOR, 0, middle], [0, FACTOR, middle], [0, 0, 1.0]])


def _homogeneous(affine: Floats) -> Floats:
    """Return the matrix (3, 3) of an affine map (2, 3)."""
    return np.vstack([affine, [0, 0, 1.0]])
