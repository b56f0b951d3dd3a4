"""Photographs out of files: pictures, or the frames of one video."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from restore.errors import BadInput
from restore.photo.photograph import Photograph, read_photograph
from restore.photo.video import Progress, is_video, read_video
from restore.runtime.arguments import checks_types


@checks_types
def read_photographs(paths: Sequence[Path | str], progress: Progress | None = None) -> list[Photograph]:
    """Read photographs, or the sharpest frames of one video.

    Photographs are rotated as EXIF says and converted to sRGB.
    progress: called as progress(stage, fraction done) while a video is read.
    Raises BadInput for a video among other files, and for files that are missing, damaged or too large, LibraryMissing
    for a HEIC picture without pi-heif.

    >>> from tempfile import TemporaryDirectory
    >>> from PIL import Image
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "IMG_1.jpg"
    ...     Image.new("RGB", (120, 90)).save(path)
    ...     (photograph,) = read_photographs([path])
    >>> photograph.name, photograph.image.shape
    ('IMG_1.jpg', (90, 120, 3))
    """
    files = [Path(path) for path in paths]
    videos = [path for path in files if is_video(path)]
    if not videos:
        return [read_photograph(path) for path in files]
    if len(files) > 1:
        raise BadInput(f"{videos[0]} is a video", "give a video by itself: its frames are the photographs")
    return read_video(videos[0], progress or _silent)


def _silent(_stage: str, _done: float) -> None:
    """Progress that is not shown."""
