"""The frames of a video are its sharpest, spread over the motion of the camera."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from restore import BadInput, read_photographs
from restore.photo.video import is_video, read_video, spread

SIZE = (320, 240)
STEP_PX = 4
STILL, MOVING = 20, 60  # frames
BLURRED_PX = 3.0
CODES = 6.0  # mean, of a frame through motion JPEG


def silent(_stage: str, _done: float) -> None:
    """Progress that nobody watches."""


def scene() -> np.ndarray:
    """A wide picture of blocks, which a video pans over."""
    blocks = np.random.default_rng(2).integers(30, 226, (24, 70, 3), np.uint8)
    return cv2.resize(blocks, None, fx=10, fy=10, interpolation=cv2.INTER_NEAREST)


@pytest.fixture
def frames():
    """A pan that begins with a rest, every third frame of it sharp."""
    wide, pictures = scene(), []
    for number in range(STILL + MOVING):
        left = STEP_PX * max(number - STILL, 0)
        picture = wide[: SIZE[1], left : left + SIZE[0]]
        pictures.append(picture if number % 3 == 0 else cv2.GaussianBlur(picture, (0, 0), BLURRED_PX))
    return pictures


def written(path, frames):
    video = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 30, SIZE)
    for frame in frames:
        video.write(np.ascontiguousarray(frame))
    video.release()
    return path


def test_sharp_frames_are_spread_over_the_motion(frames, tmp_path):
    chosen = read_video(written(tmp_path / "pan.avi", frames), silent, frames=6)
    numbers = [int(one.name.split()[-1]) - 1 for one in chosen]
    assert len(numbers) == 6
    assert all(number % 3 == 0 for number in numbers)
    assert sum(number < STILL + MOVING / 6 for number in numbers) == 1  # the rest at the start is one place
    assert np.diff(numbers[1:]).max() <= MOVING / 6 + 6
    for one, number in zip(chosen, numbers, strict=True):
        assert np.abs(one.image[..., ::-1].astype(float) - frames[number]).mean() < CODES


def test_a_camera_that_stands_still_is_refused(frames, tmp_path):
    with pytest.raises(BadInput, match="stands still"):
        read_video(written(tmp_path / "still.avi", frames[:STILL]), silent)


@pytest.mark.parametrize("content", [b"", b"no video", b"RIFF\x10\0\0\0AVI LIST" + bytes(40)])
def test_what_is_not_a_video_is_refused(tmp_path, content, capfd):
    path = tmp_path / "broken.avi"
    path.write_bytes(content)
    with pytest.raises(BadInput, match=r"broken\.avi"):
        read_video(path, silent)
    assert capfd.readouterr() == ("", "")


def test_a_missing_video_is_named(tmp_path):
    with pytest.raises(BadInput, match="not there"):
        read_video(tmp_path / "none.mp4", silent)


def test_a_video_is_read_by_itself(frames, tmp_path):
    path = written(tmp_path / "pan.avi", frames)
    assert len(read_photographs([path])) > 6
    cv2.imwrite(str(tmp_path / "a.png"), frames[0])
    (picture,) = read_photographs([tmp_path / "a.png"])
    assert picture.name == "a.png"
    with pytest.raises(BadInput, match=r"pan\.avi is a video"):
        read_photographs([tmp_path / "a.png", path])


def test_each_fraction_of_the_way_gives_its_sharpest():
    chosen = spread(np.array([1.0, 5, 2, 9, 3, 4]), np.array([0.0, 0.1, 0.4, 0.6, 0.9, 1.0]), 2)
    assert chosen.tolist() == [1, 3]


def test_videos_are_known_by_their_ending(tmp_path):
    assert is_video(tmp_path / "a.MOV")
    assert not is_video(tmp_path / "a.jpg")
