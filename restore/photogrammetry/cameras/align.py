"""Scale and level: a model of photographs in millimetres over the table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np

from restore.camera.photo_camera import PhotoCamera, project_with_jacobian
from restore.numerics.limits import TINY
from restore.scan import Floats

ITERATIONS = 5  # of a triangulation: each divides what is left by ten or more
MIN_VIEWS = 3  # two agree on any move along their epipolar lines
MAX_SAMPLES = 200  # of 10 views there are 120
MIN_MARKERS = 4  # three give a similarity, and one to spare
MAX_OFFSET = 1e-3  # of a picture's longer side: some 0.3 mm on the table, twice what the first cameras are off by


@dataclass(frozen=True, eq=False)
class Similarity:
    """A change of frame: a point p goes to scale · rotation · p + shift."""

    scale: float
    rotation: Floats
    shift: Floats

    def points(self, points: Floats) -> Floats:
        """Return points (n, 3) in the other frame."""
        return np.asarray(self.scale * points @ self.rotation.T + self.shift)

    def camera(self, camera: PhotoCamera) -> PhotoCamera:
        """The camera in the other frame: what it sees of the moved points is the same."""
        rotation = camera.rotation @ self.rotation.T
        vector = camera.vector.copy()
        vector[:3] = cv2.Rodrigues(rotation)[0].ravel()
        vector[3:6] = self.scale * camera.vector[3:6] - rotation @ self.shift
        return PhotoCamera(vector, camera.size)


def fit_similarity(here: Floats, there: Floats) -> Similarity:
    """Return the similarity that brings points nearest to others.

    here, there: (n, 3). Source: Umeyama, PAMI 13(4), 1991, eq. 40–42.
    """
    from_middle, to_middle = here - here.mean(axis=0), there - there.mean(axis=0)
    left, values, right = np.linalg.svd(to_middle.T @ from_middle)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = (left * signs) @ right
    scale = float((values * signs).sum() / max((from_middle**2).sum(), TINY))
    return Similarity(scale, rotation, there.mean(axis=0) - scale * rotation @ here.mean(axis=0))


def triangulate(cameras: Sequence[PhotoCamera], pixels: Floats) -> Floats:
    """Return the point (3,) that cameras see at pixels (v, 2).

    By least squares of the reprojection errors, from the point nearest to the undistorted lines of sight.
    """
    gram, side = np.zeros((3, 3)), np.zeros(3)
    for camera, pixel in zip(cameras, pixels, strict=True):
        way = line_of_sight(camera, pixel)
        across = np.eye(3) - np.outer(way, way)
        gram += across
        side += across @ camera.position
    point: Floats = np.linalg.solve(gram, side).astype(np.float64)
    for _ in range(ITERATIONS):
        rows, errors = [], []
        for camera, pixel in zip(cameras, pixels, strict=True):
            seen, jacobian = project_with_jacobian(camera.vector, point[None])
            # A shift of the point is one of the camera, turned into its frame.
            rows.append(jacobian[0, :, 3:6] @ camera.rotation)
            errors.append(pixel - seen[0])
        point += np.linalg.lstsq(np.concatenate(rows), np.concatenate(errors), rcond=None)[0]
    return point


def line_of_sight(camera: PhotoCamera, pixel: Floats) -> Floats:
    """Return the unit vector (3,) along the line of sight of a pixel (2,)."""
    focal, cx, cy = camera.vector[6:9]
    matrix = np.array([[focal, 0, cx], [0, focal, cy], [0, 0, 1.0]])
    tangents = cv2.undistortPoints(np.asarray(pixel, float).reshape(1, 1, 2), matrix, camera.vector[9:]).ravel()
    way = np.array([*tangents, 1.0]) @ camera.rotation
    return np.asarray(way / np.linalg.norm(way))


def triangulate_markers(
    cameras: Mapping[int, PhotoCamera], seen: Mapping[int, Mapping[int, Floats]]
) -> dict[int, Floats]:
    """Return the centre (3,) of each marker in MIN_VIEWS or more, in the cameras' frame.

    seen: photograph → marker → pixel (2,), of views that agree.
    """
    numbers = sorted({marker for markers in seen.values() for marker in markers})
    found = {}
    for marker in numbers:
        views = [number for number, markers in seen.items() if marker in markers]
        if len(views) >= MIN_VIEWS:
            pixels = np.array([seen[number][marker] for number in views])
            found[marker] = triangulate([cameras[number] for number in views], pixels)
    return found


def upright(normal: Floats, up: Floats) -> Floats:
    """Return the axes (3, 3): rows right, up and out of a plane.

    normal: (3,), unit vector.
    up: (3,), to which the axis up is as near as can be.
    """
    along = up - normal * (up @ normal)
    along = along / max(float(np.linalg.norm(along)), TINY)
    return np.stack([np.cross(along, normal), along, normal])


def views_that_agree(cameras: Mapping[int, PhotoCamera], seen: Mapping[int, Mapping[int, Floats]]) -> list[int]:
    """Return the most views in which the markers lie as on one card.

    In the others page or card were moved. A consensus of views over samples of three (Fischler & Bolles, Comm. ACM
    24(6), 1981). Fewer than three views with MIN_MARKERS markers cannot disagree: all are returned.
    seen: by view and marker, the pixel (2,) of its centre.
    """
    views = [number for number in cameras if len(seen.get(number, {})) >= MIN_MARKERS]
    if len(views) < MIN_VIEWS:
        return views
    sights = {view: _sights(cameras[view], seen[view]) for view in views}
    best: tuple[int, float, list[int]] = (0, 0.0, [])
    for sample in _samples(views):
        points = _nearest_points([sights[view] for view in sample])
        if len(points) < MIN_MARKERS:
            continue
        off = {view: _offset(cameras[view], seen[view], points) for view in views}
        agreeing = [view for view in views if off[view] < MAX_OFFSET * max(cameras[view].size)]
        if set(sample) <= set(agreeing):
            best = max(best, (len(agreeing), -sum(off[view] for view in agreeing), agreeing))
    return best[2]


def agreeing_markers(
    cameras: Mapping[int, PhotoCamera], seen: Mapping[int, Mapping[int, Floats]]
) -> dict[int, Mapping[int, Floats]]:
    """What is seen, view → marker → pixel (2,), in the views that agree."""
    return {view: seen[view] for view in views_that_agree(cameras, seen)}


def _samples(views: Sequence[int]) -> list[tuple[int, ...]]:
    """All samples of three views, or MAX_SAMPLES of them spread evenly."""
    samples = list(combinations(views, MIN_VIEWS))
    return samples[:: -(-len(samples) // MAX_SAMPLES)]


def _sights(camera: PhotoCamera, seen: Mapping[int, Floats]) -> dict[int, tuple[Floats, Floats]]:
    """Return the normal equations of each marker's line of sight.

    By marker, (3, 3) and (3,), of the distance of a point from the line.
    """
    equations = {}
    for marker, pixel in seen.items():
        way = line_of_sight(camera, pixel)
        across = np.eye(3) - np.outer(way, way)
        equations[marker] = across, across @ camera.position
    return equations


def _nearest_points(sights: Sequence[Mapping[int, tuple[Floats, Floats]]]) -> dict[int, Floats]:
    """Return the point (3,) nearest to its lines of sight for markers that all views show."""
    common = set.intersection(*(set(one) for one in sights))
    sums = {marker: [sum(one[marker][k] for one in sights) for k in (0, 1)] for marker in common}
    return {marker: np.asarray(np.linalg.pinv(gram) @ side, np.float64) for marker, (gram, side) in sums.items()}


def _offset(camera: PhotoCamera, seen: Mapping[int, Floats], points: Mapping[int, Floats]) -> float:
    """Return the median reprojection error, pixels, of a view's markers at points (3,)."""
    common = [marker for marker in points if marker in seen]
    if not common:
        return float("inf")
    pixels = camera.project(np.array([points[marker] for marker in common]))
    distances = np.linalg.norm(pixels - np.array([seen[marker] for marker in common]), axis=1)
    return float(np.median(np.nan_to_num(distances, nan=np.inf)))
