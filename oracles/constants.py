"""The named numbers of modules, with their kinds, and which of them a scan reads.

A constant is a name in capitals at the top level of a module whose value holds a number. Its kind says where the number
comes from:

exact      follows from mathematics, units or the arithmetic, or guards against its rounding
standard   a format, a standard or a device prescribes it
budget     bounds time, memory, iterations, the size of an input, or how finely is sampled or searched
tuned      all others: somebody has chosen it

What is in no table below is tuned.
"""

from __future__ import annotations

import ast
import re
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[1]
KINDS = ("exact", "standard", "budget", "tuned")
LAYOUTS = ("restore/formats/", "restore/phones/")  # of files: standard, but for their limits
BY_NAME = {
    "exact": r"TERMS|FIELDS|\w*_FIELDS|PARAMETERS|TINY|MM_PER_\w+|LINEAR|_CODE|PAPER|NOWHERE|SIDES|POWERS|MOMENTS",
    "budget": r"(?:\w+_)?(?:ITERATIONS|ROUNDS|PASSES|TRIALS|ATTEMPTS|REFINEMENTS|REFITS|SPARED|SHRINK|AT_ONCE|SEED)"
    r"|BAND|MAX_(?:\w+_)?(?:PIXELS|BYTES|FRAMES|STEPS|NODES|NAMES?|ITEMS|LINES?|FEATURES|TAPS|ITERATIONS|SUBDIVISIONS)",
}
# Those whose name does not say it: module → names.
BY_PLACE = {
    "exact": {
        "camera/pinhole": "MIN_POINTS NEARLY_PARALLEL",
        "edits/finish": "EMPTY",
        "edits/model": "COORDINATES",
        "flattening/isometric/angle_synchronisation": "SHORTEST",
        "flattening/isometric/fan_orientation": "BY_CHANCE",
        "flattening/isometric/preconditioner": "GROWTH MODES STIFFEN",
        "flattening/isometric/repair": "OPEN",
        "flattening/ordered_grid": "FOURTH MIN_REACH NO_LENGTH",
        "flattening/published/applicable": "DAMPING",
        "flattening/published/stick_kernels": "GOLDEN",
        "flattening/published/sticks": "FLAT_HEIGHT",
        "layout/crease": "SPAN",
        "mesh/decimation_bias": "OUTSIDE",
        "mesh/flattenable": "NARROW",
        "mesh/measures": "MIN_HEIGHT_RATIO",
        "mesh/ordered_grid": "RIDGE",
        "mesh/places": "STEP",
        "mesh/raster": "EDGE_TOLERANCE FARTHEST MIN_SLOPE",
        "mesh/strain": "LOOSE",
        "mesh/surface_lengths": "SHRUNK",
        "mesh/triangulate": "MAX_SNAP_DISTANCE",
        "mesh/validate": "FARTHEST_MM",
        "numerics/limits": "SQUARE_TINY SMALL SINGLE_PRECISION SINGLE_TINY",
        "numerics/robust": "MAD_TO_SIGMA MAJORITY",
        "numerics/units": "UNIT_MM",
        "orientation": "RIGHT_ANGLES MIRROR",
        "outline/picture_edge": "PROFILE",
        "outline/sides": "OUTLINE_ERROR MAX_SHIFT",
        "photo/consensus": "MIN_WITNESSES",
        "photo/orientation": "QUARTERS",
        "photo/paint": "MIN_SHARE",
        "photo/photograph": "SIXTEEN_BIT",
        "photo/pose": "MIN_POINTS FREE_STRAIGHT",
        "photo/register": "MIN_PLACES MIRROR_SIDE",
        "photogrammetry/cameras/align": "MIN_VIEWS",
        "photogrammetry/cameras/bundle": "OWN SHARED LENS",
        "photogrammetry/cameras/card": "INK",
        "photogrammetry/surfaces/discs": "MIN_POINTS RIDGE",
        "photogrammetry/surfaces/lattice": "LOOSE REACH",
        "photogrammetry/mesh": "ROWS MIN_AREA",
        "photogrammetry/page_boundary": "MIN_VIEWS",
        "photogrammetry/surfaces/pieces": "CUBIC MIN_BESIDE",
        "photogrammetry/cameras/sharpness": "OF_DIFFERENCE OF_A_STEP",
        "photogrammetry/surfaces/spline": "TINY_WEIGHT DAMPING",
        "photogrammetry/sweep": "SIDE",
        "photogrammetry/track": "MIN_VIEWS",
        "photogrammetry/track_and_adjust": "LAST",
        "prepared/facet_sheet": "HALF",
        "range_image/facets/creases": "MAX_SPREAD",
        "range_image/facets/normals": "DENSE_OVER",
        "range_image/facets/quadratic_fit": "PACKED SUMS ROW_MOMENTS MIN_SAMPLES SINGULAR MAX_LEVERAGE",
        "range_image/facets/slope_statistics": "SQUARED KEPT FULL",
        "range_image/facets/tangent_fit": "ALL_POWERS",
        "range_image/remove_table": "MIN_OF_TABLE MIN_VIEW",
        "range_image/segmentation/segment": "CLOSING_DIAMETER MAX_LOST",
        "range_image/segmentation/surface": "PLANE BOWED BLOCK",
        "runtime/kernel_cache": "PACKAGE",
        "scan_check": "FARTHEST_PX",
        "shading/certainty": "STEPS",
        "shading/crease_residual": "ABOVE FARTHEST",
        "shading/divide": "BACK",
        "shading/horizon_map": "_AZIMUTH ONWARD",
        "shading/lamps": "RIDGE",
        "shading/light": "ROOM",
        "shading/shadow_edges": "EDGES",
        "shading/steps": "CELL FARTHEST",
        "structured_light/decode": "NOISE_MASK NOISE_GAIN MIN_NOISE HALF_LIGHT LIT_SIGMAS",
        "structured_light/locate": "MIN_EDGES SHIFTS ROUNDED",
        "texture/coverage": "NO_PICTURE",
        "texture/occlusion": "SAME_AREA STEEPEST_COSINE",
        "texture/page": "LIGHT_DIRECTION",
        "texture/super_resolution": "MIN_SHOTS",
        "turntable/axis": "MIN_CORNERS",
        "turntable/merge": "ONE_SIGMA_PERCENTILE QUARTER_DEG",
        "uncertainty/calibration": "NORMAL_95",
        "uncertainty/noise": "LAGS",
    },
    "standard": {
        "edits/model": "VERSION",
        "flattening/published/springs": "GRAVITY TIME_STEP PAGE_SIZE",
        "flattening/published/sticks": "GRAVITY TIME_STEP PAGE_SIZE AREA_CHANGE",
        "mesh/places": "FACTOR SHIFT",
        "numerics/units": "MAX_COORDINATE_MM",
        "photo/dense": "MIN_TEXTURE",
        "photo/photograph": "FILM_DIAGONAL_MM HEAD UPRIGHT",
        "photogrammetry/cameras/card": "CELLS",
        "photogrammetry/cameras/sparse": "PHONE_FOCAL",
        "prepared/size": "MIN_PAGE_MM MAX_PAGE_MM MIN_SIDE_MM FAR",
        "range_image/organise": "PIXELS_PER_SAMPLE MIN_DEPTH_MM",
        "shading/white": "LUMINANCE RED_TO_GREEN BLUE_TO_GREEN",
        "structured_light/grid": "SAMPLES",
        "uncertainty/calibration": "NOMINAL_LENGTH",
        "vivid": "TEXTURE_ROWS TEXTURE_COLS FOCAL_PX WRITTEN_MM",
    },
    "budget": {
        "camera/rays": "SUBSET_STRIDE",
        "edits/apply": "SPINE_POINTS",
        "edits/model": "MAX_POINTS",
        "flattening/isometric/fan_orientation": "MAX_WAYS",
        "flattening/isometric/gauss_newton": "INEXACTNESS GRADIENT_TOLERANCE MIN_DECREASE",
        "flattening/isometric/least_distortion": "STILL",
        "flattening/isometric/page": "TRIED",
        "flattening/layout": "CELLS",
        "flattening/ordered_grid": "SAMPLED_ROWS",
        "flattening/published/applicable": "MAX_CELLS HALVINGS MIN_DECREASE",
        "flattening/published/springs": "AREA_CHANGE QUIET_STEPS FLAT_HEIGHT",
        "flattening/published/stick_kernels": "BLOCK",
        "flattening/published/sticks": "SWEEPS",
        "formats/folder": "COMPRESSION",
        "formats/obj_text": "PARTS PART_BYTES",
        "formats/parsing/picture": "SMALL_PIXELS BAND_ROWS",
        "formats/cleaning/rounding": "SAMPLE CROWDED",
        "layout/crease": "NEWTON_STEPS",
        "layout/crossing": "DPI",
        "layout/spine": "PER_MM",
        "mesh/clean": "MAX_PIECES",
        "mesh/decimate": "TOLERANCE",
        "mesh/jets": "MAX_NEIGHBOURS",
        "mesh/raster": "PICTURE_BANDS",
        "mesh/strain": "MAX_CELLS EDGES",
        "mesh/surface_lengths": "PROBES",
        "outline/crossings": "PLACES REACHES SHARED_SIGMAS",
        "outline/rectangle": "TRIMS BINS",
        "photo/blur": "BLURS",
        "photo/coarse": "COARSE_DPI NARROW_SIGMA OVERSAMPLING",
        "photo/dense": "ROOM GRID",
        "photo/features": "TILE TILE_MARGIN ROWS",
        "photo/obstructions": "SAMPLED FITS",
        "photo/photograph": "MIN_SIDE",
        "photo/pose": "TRIES CONFIDENCE REWEIGHTINGS LADDER",
        "photo/reference": "MAX_SIDE",
        "photo/register": "COARSE_STEPS DENSE_SIDE SETTLED BEHIND_STEP",
        "photo/video": "LOOKED_AT SIDE CORNERS FRAMES",
        "photo/visible": "BUFFER_SIDE",
        "photogrammetry/cameras/align": "MAX_SAMPLES",
        "photogrammetry/cameras/bundle": "SETTLED ROUGHLY",
        "photogrammetry/cameras/card": "DETECTION_SIDE CORNER_ACCURACY",
        "photogrammetry/card_pose": "STEPS",
        "photogrammetry/surfaces/crease": "LATTICE_MM STRIP_MM DIRECTIONS REFINEMENTS",
        "photogrammetry/surfaces/folded": "FILLINGS MEETING_STEPS",
        "photogrammetry/surfaces/gutter": "STEP_MM",
        "photogrammetry/mesh": "VERTICES",
        "photogrammetry/page": "MASK_SIDE",
        "photogrammetry/refined": "MAX_GROWTHS ROUND_SETTLED_MM",
        "photogrammetry/surfaces/relief": "NODES",
        "photogrammetry/cameras/sparse": "FEATURES SIDE",
        "photogrammetry/surfaces/surface": "FEET_STEPS SETTLED_MM COMPARED_MM REFINING_MM",
        "photogrammetry/track": "STEPS SETTLED",
        "photogrammetry/track_and_adjust": "COARSE_SIDE FINE_SIDE",
        "photogrammetry/unrolled": "STEP_MM",
        "prepared/facet_sheet": "MAX_SOLVED_POINTS STRIDES",
        "prepared/leaf_sheet": "PLACES",
        "prepared/ordered_grid": "MAX_GRID_POINTS",
        "prepared/refine": "NODES SLOPE_STRIDE FINEST_STRIDE SPLITS",
        "prepared/separate": "OUTLINE_POINTS",
        "range_image/facets/creases": "DIRECTIONS",
        "range_image/facets/facet_model": "SIGNAL_CLASSES",
        "range_image/facets/sheet": "WIDEST_STRIDE",
        "range_image/facets/slope_statistics": "LINES",
        "range_image/fit_sheet": "AFFINE_SUBSET",
        "range_image/organise": "SPECTRUM_BINS MIN_LINES",
        "range_image/resample": "MAX_GRID MAX_STEEP_GRID",
        "range_image/segmentation/plane": "EVERYWHERE",
        "range_image/segmentation/surface": "LIKELY",
        "range_image/segmentation/table": "MAX_PLANES",
        "runtime/kernel_cache": "KEPT_SECONDS",
        "runtime/threads": "MAX_THREADS BAND_PIXELS BANDS_A_THREAD",
        "scan_check": "MAX_SUPER_FACTOR",
        "settings": "MIN_POINTS",
        "shading/divide": "CODES",
        "shading/estimate": "CHECK_STRIDE PAGE CHECK_PLACES",
        "shading/horizon_map": "MAX_NODES AZIMUTHS GROWTH",
        "shading/lamps": "SAMPLES AZIMUTHS POLARS FIRST_NEARNESS SIMPLEX NEAR_SIMPLEX REFLECTED SETTLED AT_BOUND",
        "shading/paper": "LIGHT_DPI",
        "shading/regions": "MAX_REGIONS",
        "shading/steps": "TRIED",
        "shading/surroundings": "PATCH MIN_SHARE",
        "structured_light/grid": "BORDER_STEPS",
        "structured_light/patterns": "MIN_SIDE MAX_SIDE",
        "structured_light/rig": "CORRECTIONS EXACT_PX",
        "texture/coverage": "WIDTH_DPI",
        "texture/page": "KEPT_PIXELS OVERSAMPLING_TOLERANCE",
        "texture/resolution": "TILE MAX_EDGES STEPS LEVELS BINS GRID",
        "texture/super_resolution": "ECC_TOLERANCE FACTOR",
        "turntable/register": "MAX_SOURCE_POINTS CONVERGED NORMAL_NEIGHBOURS",
        "uncertainty/displacements": "PROBES PROBE_STRIDE COARSER WIDER_RADIUS",
        "uncertainty/estimate": "HALVINGS PITCH_MM",
    },
    # Somebody has chosen them, although they are with the layouts of files.
    "tuned": {
        "formats/calibration": "ORTHONORMAL",
        "formats/cleaning/doubled_lines": "WIDE",
        "formats/obj": "LARGE_MESH",
        "formats/cleaning/packing": "MARGIN",
        "formats/cleaning/rounding": "OF_MEAN_EDGE GAP MAX_OF_EDGE",
        "formats/cleaning/seams": "OVERSAMPLING",
        "formats/stl": "TEXT_BYTES",
        "formats/cleaning/texture_map": "INSETS_PX SHIFTS",
        "formats/parsing/tiles": "BORDER MAX_PAST",
        "phones/arkit": "SQUARE",
        "phones/capture": "FINE_MM MIN_AREA_MM2 MAX_VIEWS",
    },
}


class Constant(NamedTuple):
    """A constant: its module, its name, its value as it is written, and the comment beside it or above it."""

    module: str
    name: str
    value: str
    reason: str

    @property
    def kind(self) -> str:
        """One of KINDS."""
        place = self.module.removeprefix("restore/").removesuffix(".py")
        for kind, modules in BY_PLACE.items():
            if self.name in modules.get(place, "").split():
                return kind
        for kind, names in BY_NAME.items():
            if re.fullmatch(names, self.name):
                return kind
        if self.module.startswith(LAYOUTS):
            return "budget" if self.name.startswith("MAX_") else "standard"
        return "tuned"


def constants_of(path: Path) -> Iterator[Constant]:
    """The numbers of a module in their order; those that follow from others alone do not count."""
    text = path.read_text("utf-8")
    lines, module = text.split("\n"), path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else path.name
    for node in ast.parse(text).body:
        for name, value in _assigned(node):
            if name.isupper() and any(_is_number(part) for part in ast.walk(value)):
                yield Constant(module, name, ast.unparse(value), _comment(lines, node))


def constants_in(package: str) -> list[Constant]:
    """The constants of all modules of a package."""
    return [constant for path in sorted((ROOT / package).rglob("*.py")) for constant in constants_of(path)]


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def _assigned(node: ast.stmt) -> Iterator[tuple[str, ast.expr]]:
    """The names that a statement assigns to, with their values."""
    if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
        return
    for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
        names = target.elts if isinstance(target, ast.Tuple) else [target]
        values = node.value.elts if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple) else []
        for k, name in enumerate(names):
            if isinstance(name, ast.Name):
                yield name.id, values[k] if len(values) == len(names) else node.value


def _comment(lines: list[str], node: ast.stmt) -> str:
    """The comment beside an assignment and on the lines after it, or on those above it."""
    last = node.end_lineno or node.lineno
    own = [beside for line in lines[node.lineno - 1 : last] if (beside := line.partition("  # ")[2])]
    if own:
        for line in lines[last:]:
            if not line.startswith("# "):
                break
            own.append(line[2:])
        return " ".join(own)
    above = list[str]()
    for line in reversed(lines[: node.lineno - 1]):
        if not line.startswith("# "):
            break
        above.insert(0, line[2:])
    return " ".join(above)


# What a run reads: the functions that were called, and what their text names, as compiled kernels call unseen.

Symbol = tuple[str, str]
"""Module and name; of a function inside another or in a class its qualified name."""


class Sources:
    """The functions and names of a package's modules, and what each names."""

    def __init__(self, package: str) -> None:
        self._trees = {
            path.relative_to(ROOT).as_posix(): ast.parse(path.read_text("utf-8"))
            for path in sorted((ROOT / package).rglob("*.py"))
        }

    @cached_property
    def _imported(self) -> Mapping[Symbol, Symbol]:
        """What a module calls a name of another one."""
        found: dict[Symbol, Symbol] = {}
        for module, tree in self._trees.items():
            for node in ast.walk(tree):
                if isinstance(node, ast.ImportFrom) and node.module:
                    place = node.module.replace(".", "/")
                    origin = f"{place}.py" if f"{place}.py" in self._trees else f"{place}/__init__.py"
                    found |= {(module, one.asname or one.name): (origin, one.name) for one in node.names}
        return found

    @cached_property
    def _named(self) -> Mapping[Symbol, set[str]]:
        """The names in the text of each top-level function, class or value."""
        found: dict[Symbol, set[str]] = {}
        for module, tree in self._trees.items():
            for node in tree.body:
                names = {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}
                if isinstance(node, ast.FunctionDef | ast.ClassDef):
                    found[module, node.name] = names
                for name, value in _assigned(node):
                    found[module, name] = {part.id for part in ast.walk(value) if isinstance(part, ast.Name)}
        return found

    @cached_property
    def _compiled(self) -> set[Symbol]:
        """Functions that numba compiles: their calls of each other cannot be seen."""
        return {
            (module, node.name)
            for module, tree in self._trees.items()
            for node in tree.body
            if isinstance(node, ast.FunctionDef) and any("njit" in ast.unparse(one) for one in node.decorator_list)
        }

    @cached_property
    def _at(self) -> Mapping[tuple[str, int], set[str]]:
        """Module and first line of a function → the names in its own text, without those of functions inside it."""
        return {
            (module, min([node.lineno, *(one.lineno for one in node.decorator_list)])): _own_names(node)
            for module, tree in self._trees.items()
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef)
        }

    def read_by(self, called: set[tuple[str, int]]) -> set[Symbol]:
        """Modules and names of the values and kernels that functions read, themselves or through each other.

        called: module and first line of each function that was called.
        """
        return self._closure({(place[0], name) for place in called for name in self._at.get(place, ())})

    def _closure(self, symbols: set[Symbol]) -> set[Symbol]:
        """Symbols, and all values and kernels that they name, directly or through others."""
        waiting, found = list(symbols), set[Symbol]()
        while waiting:
            symbol = waiting.pop()
            symbol = self._imported.get(symbol, symbol)
            is_value = symbol[1].isupper() or symbol[1].startswith("_")
            if symbol not in found and symbol in self._named and (is_value or symbol in self._compiled):
                found.add(symbol)
                waiting += [(symbol[0], name) for name in self._named[symbol] if not self._is_plain(symbol)]
        return found

    def kernels_with(self, constant: Symbol) -> set[Symbol]:
        """The compiled functions that a constant is compiled into, by themselves or by what they call."""
        return {kernel for kernel in self._compiled if constant in self._closure({kernel})}

    def following_from(self, constant: Symbol) -> list[Symbol]:
        """The values of modules that are computed from a constant, each after those that it needs."""
        found, waiting = [], [constant]
        while waiting:
            one = waiting.pop(0)
            for (module, name), names in self._named.items():
                used = {self._imported.get((module, word), (module, word)) for word in names}
                if one in used and name.isupper() and (module, name) != one:
                    found = [*(other for other in found if other != (module, name)), (module, name)]
                    waiting.append((module, name))
        return found

    def importers_of(self, constant: Symbol) -> list[Symbol]:
        """Modules that import a name, and what they call it."""
        return [here for here, origin in self._imported.items() if origin == constant]

    def defaults_with(self, constant: Symbol) -> set[tuple[str, str, str]]:
        """Module, function and argument of each default that is a constant."""
        found = set()
        for module, tree in self._trees.items():
            for node in ast.walk(tree):
                if isinstance(node, ast.FunctionDef):
                    places, named = [*node.args.posonlyargs, *node.args.args], node.args
                    pairs = [*zip(places[len(places) - len(named.defaults) :], named.defaults, strict=True)]
                    pairs += [
                        (one, value) for one, value in zip(named.kwonlyargs, named.kw_defaults, strict=True) if value
                    ]
                    for argument, value in pairs:
                        here = (module, value.id) if isinstance(value, ast.Name) else None
                        if here and self._imported.get(here, here) == constant:
                            found.add((module, node.name, argument.arg))
        return found

    def value_of(self, module: str, name: str) -> ast.expr:
        """The expression that a name is assigned."""
        return next(value for node in self._trees[module].body for one, value in _assigned(node) if one == name)

    def _is_plain(self, symbol: Symbol) -> bool:
        """Whether a symbol is a function that would have been seen, had it been called."""
        tree = self._trees[symbol[0]]
        return symbol not in self._compiled and any(
            isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == symbol[1] for node in tree.body
        )


def _own_names(function: ast.FunctionDef) -> set[str]:
    names, waiting = set[str](), list(ast.iter_child_nodes(function))
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Name):
            names.add(node.id)
        inner = isinstance(node, ast.FunctionDef)
        waiting += [*node.decorator_list, node.args] if isinstance(node, ast.FunctionDef) else []
        waiting += [] if inner else ast.iter_child_nodes(node)
    return names


def called_in(package: str, run: Callable[[], Any]) -> set[tuple[str, int]]:
    """Module and first line of each function of a package that run() calls, in any thread."""
    codes, base = set[CodeType](), str(ROOT / package)

    def watch(frame: FrameType, event: str, _argument: Any) -> None:
        if event == "call":
            codes.add(frame.f_code)

    threading.setprofile(watch)
    sys.setprofile(watch)
    try:
        run()
    finally:
        sys.setprofile(None)
        threading.setprofile(None)  # type: ignore[arg-type]
    return {
        (Path(code.co_filename).relative_to(ROOT).as_posix(), code.co_firstlineno)
        for code in codes
        if code.co_filename.startswith(base)
    }
