"""Photographs out of a video: its sharpest frames.

They are spread evenly over the motion of the camera.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from restore.errors import BadInput
from restore.files import VIDEO_SUFFIXES
from restore.photo.photograph import MAX_PIXELS, MIN_SIDE, Photograph
from restore.scan import Bytes, Floats, Ints

FRAMES = 12  # out of a video: pairs grow with the square, and ten views are as good as twenty
MAX_FRAMES = 18_000  # five minutes at 60 a second
LOOKED_AT = 600  # frames in which sharpness and motion are measured
SIDE = 480  # pixels of the longer side of what motion is measured in
CORNERS = 200  # that are followed from frame to frame
MIN_MOTION = 0.05  # of a frame's longer side, over the whole video: less, and nothing is seen from two sides

Progress = Callable[[str, float], None]


def is_video(path: Path) -> bool:
    """Whether a file has the ending of a video."""
    return path.suffix.lower() in VIDEO_SUFFIXES


def read_video(path: Path, progress: Progress, *, frames: int = FRAMES) -> list[Photograph]:
    """Return a video's sharpest frames, one of each of `frames` equal parts of its motion.

    Raises BadInput when the video cannot be read, is too long, or the camera stands still in it.
    """
    if not path.is_file():
        raise BadInput(f"{path} is not there", "check the name and the folder")
    numbers, sharpness, travelled = _measured(path, progress)
    if travelled[-1] < MIN_MOTION:
        raise BadInput(f"{path}: the camera stands still", "move it slowly round the page, 30 degrees to all sides")
    chosen = spread(sharpness, travelled, frames)
    wanted = set(numbers[chosen].tolist())
    photographs = []
    for number, frame in _frames(path):
        if number in wanted:
            image: Bytes = np.ascontiguousarray(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB))
            photographs.append(Photograph(image, f"{path.name}, frame {number + 1}"))
            progress("frames", 0.5 + 0.5 * len(photographs) / len(wanted))
    return photographs


def spread(sharpness: Floats, travelled: Floats, count: int) -> Ints:
    """Return the sharpest frame in each of `count` equal parts of the path.

    A part without a frame gives none.
    sharpness: (n,), of the frames.
    travelled: (n,), path travelled up to each.
    """
    section = np.minimum((travelled / travelled[-1] * count).astype(int), count - 1)
    return np.array([max(np.flatnonzero(section == k), key=lambda n: sharpness[n]) for k in np.unique(section)])


def _measured(path: Path, progress: Progress) -> tuple[Ints, Floats, Floats]:
    """Measure some frames of a video.

    Returns their numbers (n,), their sharpness (n,), and the path travelled up to each (n,), in longer sides of the
    frame.
    """
    total = _length(path)
    step = max(total // LOOKED_AT, 1)
    numbers, sharpness, motion = [], [], []
    last: Bytes | None = None
    for number, frame in _frames(path):
        if number % step:
            continue
        small = _small_grey(frame)
        numbers.append(number)
        sharpness.append(float(cv2.Laplacian(small, cv2.CV_32F).var()))
        motion.append(0.0 if last is None else _motion(last, small))
        last = small
        progress("frames", min(0.5 * number / max(total, 1), 0.5))
    if len(numbers) < 2:
        raise BadInput(f"{path} holds no video that can be read", "give an MP4 or MOV file as the phone wrote it")
    return np.array(numbers), np.array(sharpness), np.cumsum(motion)


def _length(path: Path) -> int:
    """Return how many frames a video claims to have.

    Raises BadInput when it cannot be opened or has too many.
    """
    video = _opened(path)
    try:
        count = int(video.get(cv2.CAP_PROP_FRAME_COUNT)) if video.isOpened() else 0
        width, height = (video.get(side) for side in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        if not video.isOpened() or min(width, height) < MIN_SIDE or width * height > MAX_PIXELS:
            raise BadInput(f"{path} holds no video that can be read", "give an MP4 or MOV file as the phone wrote it")
    finally:
        video.release()
    if count > MAX_FRAMES:
        raise BadInput(f"{path} has {count} frames, too many", f"cut it to the page: at most {MAX_FRAMES}")
    return count


def _frames(path: Path) -> Iterator[tuple[int, Bytes]]:
    """Number and picture (h, w, 3) BGR of each frame, up to MAX_FRAMES."""
    video = _opened(path)
    try:
        for number in range(MAX_FRAMES):
            read, frame = video.read()
            if not read:
                return
            yield number, frame
    finally:
        video.release()


def _opened(path: Path) -> cv2.VideoCapture:
    """OpenCV's reader of a video, without its warnings about files that it does not know."""
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        return cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    finally:
        cv2.utils.logging.setLogLevel(level)


def _small_grey(frame: Bytes) -> Bytes:
    grey = cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)
    ratio = min(1.0, SIDE / max(grey.shape))
    return np.asarray(cv2.resize(grey, None, fx=ratio, fy=ratio, interpolation=cv2.INTER_AREA), np.uint8)


def _motion(before: Bytes, after: Bytes) -> float:
    """Return the median motion of corners between two frames.

    In longer sides of the frame; 0 without corners.
    """
    corners = cv2.goodFeaturesToTrack(before, CORNERS, 0.01, 5)
    if corners is None:
        return 0.0
    moved, found, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, None)
    ways = np.linalg.norm((moved - corners).reshape(-1, 2), axis=1)[found.ravel() > 0]
    return float(np.median(ways)) / max(before.shape) if len(ways) else 0.0
