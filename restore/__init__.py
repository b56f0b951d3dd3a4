"""Turn a 3D scan of a warped page into the flat page it once was. This is the only public door."""

# Before the first kernel is imported, so that it is kept where kernel_cache says.
from restore.kernel_cache import notify_when_compiling

# isort: split
from restore.errors import BadInput, LibraryMissing, NotEnoughSurface, RestoreError
from restore.files import read_regular, read_toml
from restore.flatten_mesh import flatten
from restore.formats import (
    PICTURE_SUFFIXES,
    SCAN_SUFFIXES,
    check_unit,
    encode_png,
    load_scan,
    read_bytes,
    read_picture,
    referenced_files,
    save_scan,
    scan_stem,
)
from restore.mesh.measures import vertex_normals
from restore.mesh.network import edges_of
from restore.mesh.ordered_grid import GridMesh
from restore.mesh.raster import rasterise
from restore.mesh.strain import average_at_vertices, face_strain
from restore.native import SYSTEM_LIBRARIES, SystemLibrary, missing_libraries
from restore.phones import PhoneCapture, is_phone_capture, load_phone_capture
from restore.photo import Photograph, is_video, read_photograph, read_video
from restore.photogrammetry import SCALE_CARD, PhotographedPage, ScaleCard, reconstruct_page, rescaled
from restore.pipeline import restore
from restore.range_image.segment import SegmentedScan
from restore.scan import Bytes, FlatMesh, Floats, Ints, Mask, RangeScan, RestoredPage, SurfaceMesh
from restore.settings import Settings
from restore.sheets import ScannedSheet, is_rectangular, separate_sheets
from restore.structured_light import Projector, draw_patterns
from restore.texture.coverage import Seen, cut_share
from restore.texture.super_resolution import finer_scan
from restore.turn import turn_page
from restore.turntable import AxisFit, RotationAxis, board_corners, fit_axis, merge_views

__all__ = [
    "PICTURE_SUFFIXES",
    "SCALE_CARD",
    "SCAN_SUFFIXES",
    "SYSTEM_LIBRARIES",
    "AxisFit",
    "BadInput",
    "Bytes",
    "FlatMesh",
    "Floats",
    "GridMesh",
    "Ints",
    "LibraryMissing",
    "Mask",
    "NotEnoughSurface",
    "PhoneCapture",
    "Photograph",
    "PhotographedPage",
    "Projector",
    "RangeScan",
    "RestoreError",
    "RestoredPage",
    "RotationAxis",
    "ScaleCard",
    "ScannedSheet",
    "Seen",
    "SegmentedScan",
    "Settings",
    "SurfaceMesh",
    "SystemLibrary",
    "average_at_vertices",
    "board_corners",
    "check_unit",
    "cut_share",
    "draw_patterns",
    "edges_of",
    "encode_png",
    "face_strain",
    "finer_scan",
    "fit_axis",
    "flatten",
    "is_phone_capture",
    "is_rectangular",
    "is_video",
    "load_phone_capture",
    "load_scan",
    "merge_views",
    "missing_libraries",
    "notify_when_compiling",
    "rasterise",
    "read_bytes",
    "read_photograph",
    "read_picture",
    "read_regular",
    "read_toml",
    "read_video",
    "reconstruct_page",
    "referenced_files",
    "rescaled",
    "restore",
    "save_scan",
    "scan_stem",
    "separate_sheets",
    "turn_page",
    "vertex_normals",
]
