"""A shot of the scanner as a scan: a file that its own program wrote is read."""

from __future__ import annotations

from drivers.scanner import ScanFile, Shot
from restore import BadInput, RangeScan, SurfaceMesh, load_scan


def read_shot(shot: Shot) -> RangeScan | SurfaceMesh:
    """Return the scan of a shot. Raises BadInput for a file that cannot be read; it is kept."""
    if not isinstance(shot, ScanFile):
        return shot
    try:
        return load_scan(shot.path, **shot.reading)
    except BadInput as error:
        raise BadInput(str(error), f"{error.hint}; the file is kept: {shot.path}") from error


def range_image_of(shot: Shot, what: str) -> RangeScan:
    """Return the scan of a shot that has to be a range image.

    what: needs it. Raises BadInput as `read_shot`, and for a mesh.
    """
    scan = read_shot(shot)
    if not isinstance(scan, RangeScan):
        raise BadInput(f"{what} needs a range image, and this scanner gives meshes", "let its program write one")
    return scan
