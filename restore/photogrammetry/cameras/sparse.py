"""Cameras and points of photographs of one lens, by COLMAP.

SIFT and incremental mapping (Schönberger & Frahm, CVPR 2016). pycolmap comes with the extra `photos` and is imported
here alone. SIFT is asked for by name: other features would fetch weights.
"""

from __future__ import annotations

import signal
import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np

from restore.camera.photo_camera import PhotoCamera
from restore.findings import Finding
from restore.photo.photograph import Photograph
from restore.photogrammetry.cameras.align import MIN_VIEWS
from restore.photogrammetry.cameras.sharpness import sharpness
from restore.photogrammetry.errors import ExtraMissing, MixedLenses, TooFewViews
from restore.runtime.threads import thread_count
from restore.scan import Bytes, Floats

Progress = Callable[[str, float], None]

SIDE = 1600  # pixels of the longer side in which features are found: the patches measure what cameras need
FEATURES = 6000  # of a photograph
SEED = 1  # of the random samples of matching and mapping
PHONE_FOCAL = 0.72  # in widths of the picture: 26 mm in terms of 35 mm film, as most phones have
SAME_FOCAL = 0.02  # relative; EXIF stores whole millimetres: ±2 % at 26 mm
MAX_ERROR_PX = 1.5  # reprojection error of a point that is kept, in pixels of the small copy
MIN_TURN_DEG = 4.0  # between the outermost lines of sight of the points, at the median: less, and depth is a guess
MIN_MATCHES = 30  # between two photographs: fewer agree by chance
SHARP = 0.15  # of the median contrast of fine detail in the set: below, a photograph was shaken
BLURRED_PX = 2.5  # standard deviation in the small copy: 10-point print is grey, and has no features
BLANK_CODES = 30.0  # contrast of a picture's strongest edges: print and the edge of a page have more


@dataclass(frozen=True, eq=False)
class SparseModel:
    """Cameras and points in a frame and scale of their own.

    cameras  of the photographs that joined, in their full size, by index.
    points   (n, 3).
    errors   (n,) rms reprojection error in pixels of the full size.
    failed   index of a photograph that did not join → why.
    """

    cameras: dict[int, PhotoCamera]
    points: Floats
    errors: Floats
    failed: dict[int, Finding]


def check_one_lens(photographs: Sequence[Photograph]) -> None:
    """Raise MixedLenses unless all photographs have one size and one focal length."""
    first = photographs[0]
    height, width = first.image.shape[:2]
    for other in photographs[1:]:
        if other.image.shape != first.image.shape:
            rows, cols = other.image.shape[:2]
            raise MixedLenses(
                f"{first.name} has {width} × {height} pixels and {other.name} {cols} × {rows}",
                "take all photographs with one camera, uncropped, and give them as the camera wrote them",
            )
    known = [photograph for photograph in photographs if photograph.focal_px]
    for other in known[1:]:
        if abs(np.log(float(other.focal_px or 1.0) / float(known[0].focal_px or 1.0))) > SAME_FOCAL:
            raise MixedLenses(
                f"{known[0].name} and {other.name} were taken at different focal lengths",
                "take all photographs with one lens and without zoom, or leave out those that differ",
            )


def reconstruct(photographs: Sequence[Photograph], progress: Progress) -> SparseModel:
    """The cameras and points of photographs of one lens.

    Raises TooFewViews when fewer than three of them join, ExtraMissing without pycolmap.
    """
    colmap = _colmap()
    height, width = photographs[0].image.shape[:2]
    ratio = min(1.0, SIDE / max(height, width))
    size = round(width * ratio), round(height * ratio)
    greys = [cv2.cvtColor(photograph.image, cv2.COLOR_RGB2GRAY) for photograph in photographs]
    small = [cv2.resize(grey, size, interpolation=cv2.INTER_AREA) if ratio < 1.0 else grey for grey in greys]
    known = [photograph.focal_px for photograph in photographs if photograph.focal_px]
    focal = float(np.median(known)) * ratio if known else PHONE_FOCAL * max(size)
    with tempfile.TemporaryDirectory(prefix="planish-") as name:
        best, matched = _mapped(colmap, Path(name), small, focal, progress)
    cameras = {} if best is None else _cameras(best, (width, height), ratio)
    failed = _reasons(small, matched, set(cameras))
    if best is None or len(cameras) < MIN_VIEWS:
        raise TooFewViews(
            f"{len(cameras)} of {len(photographs)} photographs join to one model, and {MIN_VIEWS} are needed: "
            + "; ".join(f"{photographs[k].name}: {why.text}" for k, why in failed.items()),
            "photograph the page sharply from all round, each time in full and 20 to 40 degrees from the last",
        )
    points, errors = _points(best, ratio)
    _check_parallax(cameras, points)
    return SparseModel(cameras, points, errors, failed)


def _colmap() -> ModuleType:
    """Import pycolmap and keep the process's own SIGTERM handler.

    Its import installs one that ends the process at once.
    """
    before = signal.getsignal(signal.SIGTERM)
    try:
        import pycolmap
    except ImportError as error:
        raise ExtraMissing("photographs without a scan need pycolmap", "pip install 'planish[photos]'") from error
    if before is not None and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, before)
    pycolmap.logging.minloglevel = 3
    pycolmap.set_random_seed(SEED)
    module: ModuleType = pycolmap
    return module


def _mapped(
    colmap: ModuleType, folder: Path, greys: Sequence[Bytes], focal: float, progress: Progress
) -> tuple[Any, dict[int, int]]:
    """Return the reconstruction with most views, or None.

    Returns also the most matches that each photograph has with another.
    """
    pictures, base = folder / "pictures", folder / "database.db"
    pictures.mkdir()
    for number, grey in enumerate(greys):
        cv2.imwrite(str(pictures / f"{number:04d}.png"), grey, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    height, width = greys[0].shape
    progress("features", 0.0)
    lens = colmap.ImageReaderOptions()
    lens.camera_model = "OPENCV"
    lens.camera_params = f"{focal},{focal},{width / 2},{height / 2},0,0,0,0"
    features = colmap.FeatureExtractionOptions()
    features.max_image_size, features.num_threads = max(width, height), thread_count()
    features.sift.max_num_features, features.sift.first_octave = FEATURES, 0
    single = colmap.CameraMode.SINGLE
    # Entered first, in their order: threads would number them as they finish, and the cameras would follow from that.
    colmap.Database.open(base).close()
    colmap.import_images(base, pictures, camera_mode=single, options=lens)
    shared = {"camera_mode": single, "device": colmap.Device.cpu}
    colmap.extract_features(base, pictures, reader_options=lens, extraction_options=features, **shared)
    progress("features", 1.0)
    progress("matching", 0.0)
    matching = colmap.FeatureMatchingOptions()
    matching.num_threads, matching.skip_geometric_verification = thread_count(), True
    colmap.match_exhaustive(base, matching_options=matching, device=colmap.Device.cpu)
    _verify(colmap, base)
    matched = _most_matches(colmap, base)
    progress("matching", 1.0)
    progress("cameras", 0.0)
    models = colmap.incremental_mapping(base, pictures, folder, options=_mapping(colmap))
    progress("cameras", 1.0)
    return max(models.values(), key=lambda model: model.num_reg_images(), default=None), matched


def _verify(colmap: ModuleType, base: Path) -> None:
    """Keep the matches that agree with two cameras.

    By one thread: each has its own random samples, and the result would depend on which of them verified which pair.
    """
    verification = colmap.GeometricVerifierOptions()
    verification.num_threads = 1
    colmap.geometric_verification(base, verifier_options=verification)


def _mapping(colmap: ModuleType) -> Any:
    options = colmap.IncrementalPipelineOptions()
    # By one thread: several add up the equations of an adjustment in any order.
    options.num_threads, options.multiple_models, options.extract_colors = 1, False, False
    options.min_model_size, options.ba_refine_principal_point = MIN_VIEWS, False
    # The cameras are adjusted again over thousands of better tracks: here they need not settle to the last digit.
    options.ba_global_function_tolerance, options.ba_global_max_num_iterations = 1e-6, 30
    options.ba_local_max_num_iterations, options.ba_global_max_refinements = 15, 2
    return options


def _most_matches(colmap: ModuleType, base: Path) -> dict[int, int]:
    most: dict[int, int] = {}
    with colmap.Database.open(base) as database:
        numbers = {image.image_id: int(Path(image.name).stem) for image in database.read_all_images()}
        for pair, geometry in zip(*database.read_two_view_geometries(), strict=True):
            one, other = (numbers[number] for number in colmap.pair_id_to_image_pair(pair))
            count = len(geometry.inlier_matches)
            for number in (one, other):
                most[number] = max(most.get(number, 0), count)
    return most


def _cameras(model: Any, size: tuple[int, int], ratio: float) -> dict[int, PhotoCamera]:
    """Return a reconstruction's cameras in the full size (w, h), by photograph's index."""
    cameras = {}
    for image in model.images.values():
        if not image.has_pose:
            continue
        fx, fy, cx, cy, k1, k2, p1, p2 = model.cameras[image.camera_id].params
        pose = image.cam_from_world().matrix()
        turn = cv2.Rodrigues(pose[:, :3])[0].ravel()
        # Here the centre of the upper left pixel is (0.5, 0.5), and lenses have two focal lengths.
        lens = [np.sqrt(fx * fy), cx - 0.5, cy - 0.5, k1, k2, p1, p2, 0.0]
        small = PhotoCamera(np.array([*turn, *pose[:, 3], *lens]), (round(size[0] * ratio), round(size[1] * ratio)))
        cameras[int(Path(image.name).stem)] = small.scaled(size)
    return dict(sorted(cameras.items()))


def _points(model: Any, ratio: float) -> tuple[Floats, Floats]:
    """Return a reconstruction's reliable points (n, 3) and errors (n,), full-size pixels."""
    kept = [
        (*point.xyz, point.error)
        for point in model.points3D.values()
        if point.error < MAX_ERROR_PX and point.track.length() >= MIN_VIEWS
    ]
    table = np.array(kept).reshape(-1, 4)
    return table[:, :3], table[:, 3] / ratio


def _reasons(greys: Sequence[Bytes], matched: dict[int, int], joined: set[int]) -> dict[int, Finding]:
    detail = [float(cv2.Laplacian(grey, cv2.CV_32F).var()) for grey in greys]
    usual = float(np.median(detail))
    reasons: dict[int, str] = {}
    for number, grey in enumerate(greys):
        if number in joined:
            continue
        edges = sharpness(grey)
        if edges.contrast < BLANK_CODES:
            reasons[number] = "it is blank"
        elif edges.blur > BLURRED_PX:
            reasons[number] = f"it is blurred: its sharpest edges are {2 * edges.blur / max(grey.shape):.2%} of it wide"
        elif detail[number] < SHARP * usual:
            reasons[number] = "it is blurred, or was shaken"
        elif matched.get(number, 0) < MIN_MATCHES:
            reasons[number] = "it shows nothing that another photograph shows, too"
        elif not joined:
            reasons[number] = "it is taken from the same place as the others, or its print does not agree with theirs"
        else:
            reasons[number] = "its print does not agree with that of the others"
    return {number: Finding.of("not_joined", reason=reason) for number, reason in reasons.items()}


def _check_parallax(cameras: dict[int, PhotoCamera], points: Floats) -> None:
    """Raise TooFewViews when all cameras look from one side: depth would rest on nothing."""
    middle = np.median(points, axis=0) if len(points) else np.zeros(3)
    ways = np.array([camera.position - middle for camera in cameras.values()])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    widest = np.degrees(np.arccos(np.clip(ways @ ways.T, -1.0, 1.0).min()))
    if len(points) == 0 or widest < MIN_TURN_DEG:
        raise TooFewViews(
            f"the photographs are taken from places only {widest:.1f} degrees apart",
            "photograph the page from all round, 20 to 40 degrees from straight above",
        )
