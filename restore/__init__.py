"""Turn a 3D scan of a warped page into the flat page it once was. This is the only public door."""

from restore.errors import BadInput, LibraryMissing, NotEnoughSurface, RestoreError
from restore.flatten_mesh import flatten
from restore.formats import load_scan
from restore.photo import Photograph, read_photograph
from restore.pipeline import restore
from restore.scan import FlatMesh, RangeScan, RestoredPage, SurfaceMesh
from restore.settings import Settings

__all__ = [
    "BadInput",
    "FlatMesh",
    "LibraryMissing",
    "NotEnoughSurface",
    "Photograph",
    "RangeScan",
    "RestoreError",
    "RestoredPage",
    "Settings",
    "SurfaceMesh",
    "flatten",
    "load_scan",
    "read_photograph",
    "restore",
]
