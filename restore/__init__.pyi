# The names of the public door and where they come from. They are imported when they are first used.
from .edits.model import PageEdits as PageEdits, PartEdits as PartEdits, parse_edits as parse_edits
from .errors import (
    BadInput as BadInput,
    NotEnoughSurface as NotEnoughSurface,
    RestoreError as RestoreError,
)
from .findings import Finding as Finding
from .formats import load_scan as load_scan, save_scan as save_scan
from .layout.find import find_layout as find_layout
from .layout.finding import BookPrior as BookPrior, LayoutFinding as LayoutFinding
from .leaves import restore_leaves as restore_leaves
from .orientation import mirror_page as mirror_page, rotate_page as rotate_page
from .page import FlatMesh as FlatMesh, RestoredPage as RestoredPage
from .phones.load import load_capture as load_capture
from .photo import Photograph as Photograph, read_photographs as read_photographs
from .photogrammetry import ScaleCard as ScaleCard, reconstruct_page as reconstruct_page
from .pipeline import restore as restore
from .prepared.flatten import flatten as flatten
from .prepared.separate import separate_sheets as separate_sheets
from .scan import RangeScan as RangeScan, SurfaceMesh as SurfaceMesh
from .settings import Settings as Settings
from .structured_light import Projector as Projector
from .texture.coverage import CoverageClass as CoverageClass
from .texture.super_resolution import super_resolve as super_resolve
from .turntable import (
    RotationAxis as RotationAxis,
    fit_axis as fit_axis,
    merge_views as merge_views,
)
