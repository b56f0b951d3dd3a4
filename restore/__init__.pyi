# The names of the public door and where they come from. They are imported when they are first used.
from .errors import (
    BadInput as BadInput,
    LibraryMissing as LibraryMissing,
    NotEnoughSurface as NotEnoughSurface,
    RestoreError as RestoreError,
)
from .files import (
    read_regular as read_regular,
    read_toml as read_toml,
)
from .findings import Finding as Finding
from .formats import (
    PICTURE_SUFFIXES as PICTURE_SUFFIXES,
    SCAN_SUFFIXES as SCAN_SUFFIXES,
    check_unit as check_unit,
    encode_png as encode_png,
    load_scan as load_scan,
    read_bytes as read_bytes,
    read_picture as read_picture,
    referenced_files as referenced_files,
    save_scan as save_scan,
    scan_stem as scan_stem,
)
from .mesh.measures import vertex_normals as vertex_normals
from .mesh.network import edges_of as edges_of
from .mesh.ordered_grid import GridMesh as GridMesh
from .mesh.raster import rasterise as rasterise
from .mesh.strain import (
    average_at_vertices as average_at_vertices,
    face_strain as face_strain,
)
from .page import FlatMesh as FlatMesh, RestoredPage as RestoredPage
from .phones.capture import PhoneCapture as PhoneCapture, load_phone_capture as load_phone_capture
from .phones.detect import is_phone_capture as is_phone_capture
from .photo import (
    Photograph as Photograph,
    is_video as is_video,
    read_photograph as read_photograph,
    read_video as read_video,
)
from .photogrammetry import (
    SCALE_CARD as SCALE_CARD,
    PhotographedPage as PhotographedPage,
    ScaleCard as ScaleCard,
    reconstruct_page as reconstruct_page,
    rescaled as rescaled,
)
from .pipeline import restore as restore
from .prepared.flatten import flatten as flatten
from .prepared.separate import (
    ScannedSheet as ScannedSheet,
    is_rectangular as is_rectangular,
    separate_sheets as separate_sheets,
)
from .range_image.segmentation.segment import SegmentedScan as SegmentedScan
from .runtime.kernel_cache import notify_when_compiling as notify_when_compiling
from .runtime.native import (
    SYSTEM_LIBRARIES as SYSTEM_LIBRARIES,
    SystemLibrary as SystemLibrary,
    missing_libraries as missing_libraries,
)
from .scan import (
    Bytes as Bytes,
    Floats as Floats,
    Ints as Ints,
    Mask as Mask,
    RangeScan as RangeScan,
    SurfaceMesh as SurfaceMesh,
)
from .settings import Settings as Settings
from .structured_light import (
    Projector as Projector,
    draw_patterns as draw_patterns,
)
from .texture.coverage import (
    Seen as Seen,
    cut_share as cut_share,
)
from .texture.super_resolution import finer_scan as finer_scan
from .turn import turn_page as turn_page
from .turntable import (
    AxisFit as AxisFit,
    RotationAxis as RotationAxis,
    board_corners as board_corners,
    fit_axis as fit_axis,
    merge_views as merge_views,
)
