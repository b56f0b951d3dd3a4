"""Loads any capture: a scan, or the folder of a phone with photographs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.parsing.unit import AUTO
from restore.phones.detect import is_phone_capture
from restore.photo import Photograph
from restore.runtime.arguments import checks_types
from restore.scan import RangeScan, SurfaceMesh


@dataclass(frozen=True, eq=False)
class Capture:
    """A scan, and photographs that came with it.

    scan         the surface.
    photographs  with their cameras in the frame of the scan; empty for what is not a phone's capture.
    """

    scan: RangeScan | SurfaceMesh
    photographs: tuple[Photograph, ...] = ()


@checks_types
def load_capture(
    path: Path | str, texture: Path | str | None = None, *, unit: str = AUTO, grid: str = AUTO, depth: str = AUTO
) -> Capture:
    """Read a scan as `load_scan` does, or the page and photographs of a phone's folder.

    path: as for `load_scan`, or a folder that Polycam (raw data) or 3d Scanner App (all data) exported. Such a folder
    is in metres and has its own photographs. texture, unit, grid, depth: as for `load_scan`.
    Raises BadInput as `load_scan`, and for a phone's folder with a texture, NotEnoughSurface when the photographs of
    such a folder show no paper.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "square.obj"
    ...     lines = ["v 0 0 0", "v 10 0 0", "v 10 10 0", "v 0 10 0", "f 1 2 3", "f 1 3 4"]
    ...     _ = path.write_text("\\n".join(lines))
    ...     capture = load_capture(path)
    >>> capture.scan.vertices.shape, capture.photographs
    ((4, 3), ())
    """
    path = Path(path)
    if not is_phone_capture(path):
        return Capture(load_scan(path, texture, unit=unit, grid=grid, depth=depth))
    if texture is not None:
        raise BadInput(f"{path} has its own photographs", "leave --texture out; --photo adds another")
    from restore.phones.capture import load_phone_capture  # brings photogrammetry, which no other scan needs

    return Capture(*load_phone_capture(path))
