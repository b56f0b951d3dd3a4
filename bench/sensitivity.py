"""`python -m bench.sensitivity [--seed S] [--only WORD]`: which tuned constants of a scan's default path matter.

Each is halved and doubled in a process of its own, with what follows from it, and kernels that read it are compiled
again. Measured are, on fresh sheets, the errors of layout and of size, the light that is left on paper, and the samples
of table scenes that are lost or foreign. A line shows by how much the worst of these figures changed, in per cent of
its value; one that matters halved is not doubled. At last those that changed nothing by more than SAME are named.
"""

from __future__ import annotations

import argparse
import ast
import gc
import json
import os
import pickle
import signal
import sys
import tempfile
import types
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numba.core.caching import NullCache

from bench.layout import SHEETS as KINDS
from bench.table_scenes import scene_shot
from drivers.simulated import Pose, shoot
from drivers.simulated.scene.artwork import ARTWORK
from oracles.constants import Sources, Symbol
from oracles.constants_page import on_default_path
from oracles.layout import layout_error
from restore import RestoreError, restore
from restore.camera.rays import find_rays
from restore.range_image.segmentation.segment import find_sheet

SAME = 0.02  # of a figure
SHEETS = {"deep gutter": "text", "crumpled": "markers"}  # and their prints
TABLES = 4  # scenes
MAX_SECONDS = 120  # of a variant
FLOORS = {"layout": 0.002, "size": 0.02, "light": 0.002, "table": 0.0005}  # mm, mm, of the light, of the samples: less
# than that is noise of the figure
FACTORS = (0.5, 2.0)


def draw(folder: Path, seed: int) -> None:
    """Write the cases of a seed into a folder."""
    shots, rng = [], np.random.default_rng(seed)
    for kind, artwork in SHEETS.items():
        pose = Pose(tilt_deg=rng.uniform(-5, 5), turn_deg=rng.uniform(-5, 5))
        options: dict[str, Any] = {"mode": "fast", "pose": pose, "seed": int(rng.integers(2**31))}
        shots.append(shoot(KINDS[kind][1](rng), ARTWORK[artwork](), **options))
    scenes = [scene for number in range(seed, seed + TABLES) if (scene := scene_shot(number))]
    plain = [(scan, types.SimpleNamespace(flat=truth.flat, page_mm=truth.page_mm)) for scan, truth in shots]
    (folder / "cases").write_bytes(pickle.dumps((plain, [(scene.scan, scene.on_page) for scene in scenes])))


def figures(folder: Path) -> dict[str, list[float]]:
    """The errors of the cases in a folder: for each figure a list."""
    shots, scenes = pickle.loads((folder / "cases").read_bytes())
    found: dict[str, list[float]] = {name: [] for name in FLOORS}
    for scan, truth in shots:
        try:
            page = restore(scan)
        except RestoreError:
            for name in ("layout", "size", "light"):
                found[name].append(np.inf)
            continue
        error = layout_error(page, scan, truth)
        found["layout"].append(float(np.sqrt((error**2).sum(axis=1).mean())))
        sides = zip(page.report["page_mm"], truth.page_mm, strict=True)
        found["size"].append(max(abs(mine - true) for mine, true in sides))
        found["light"].append(_unevenness(page.image, page.mask))
    for scan, on_page in scenes:
        own = scan.measured & on_page
        try:
            sheet = find_sheet(scan, find_rays(scan))
            wrong = (own & ~sheet.inside).sum() + (sheet.samples & ~on_page).sum()
        except RestoreError:
            wrong = own.sum()
        found["table"].append(float(wrong / max(own.sum(), 1)))
    return found


def _unevenness(image: np.ndarray, mask: np.ndarray) -> float:
    """Spread of the light on bare paper: half the distance between its 16th and 84th percentiles over the median."""
    light = image[..., 1][mask].astype(float)
    paper = light[light > 0.8 * np.percentile(light, 90)]
    low, middle, high = np.percentile(paper, [16, 50, 84])
    return float((high - low) / 2 / middle)


def changed(before: dict[str, list[float]], after: dict[str, list[float]]) -> dict[str, float]:
    """The greatest change of each figure, of its value and its floor; infinite where a page is refused."""
    most = {}
    for name, floor in FLOORS.items():
        one, other = np.array(before[name]), np.array(after[name])
        most[name] = float((np.abs(other - one) / (np.abs(one) + floor / SAME)).max(initial=0.0))
    return most


# In the process of a variant


def scale_constant(sources: Sources, constant: Symbol, factor: float) -> None:
    """Multiply a constant wherever its value, or one that follows from it, is held; kernels are compiled again."""
    for module, name in [constant, *sources.following_from(constant)]:
        held = sys.modules.get(dotted(module))
        if held is None:
            continue
        tree = sources.value_of(module, name)
        if (module, name) == constant:
            scale_numbers(tree, factor)
        after = eval(compile(ast.Expression(tree), module, "eval"), vars(held))
        setattr(held, name, after)
        for other in sources.importers_of((module, name)):
            if loaded := sys.modules.get(dotted(other[0])):
                setattr(loaded, other[1], after)
        _set_defaults(sources.defaults_with((module, name)), after)
    for module, name in sources.kernels_with(constant):
        if loaded := sys.modules.get(dotted(module)):
            kernel = vars(loaded)[name]
            kernel._cache = NullCache()
            kernel._reset_overloads()


def dotted(module: str) -> str:
    """The name by which a file is imported."""
    return module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _set_defaults(places: set[tuple[str, str, str]], value: Any) -> None:
    """Replace the defaults of arguments: module, function and argument."""
    for function in [one for one in gc.get_objects() if isinstance(one, types.FunctionType)]:
        wanted = {name for module, called, name in places if (dotted(module), called) == _place(function)}
        names = function.__code__.co_varnames[: function.__code__.co_argcount]
        if wanted and function.__defaults__:
            first = len(names) - len(function.__defaults__)
            both = zip(names[first:], function.__defaults__, strict=True)
            function.__defaults__ = tuple(value if name in wanted else old for name, old in both)
        for name in wanted & set(function.__kwdefaults__ or {}):
            function.__kwdefaults__[name] = value


def _place(function: types.FunctionType) -> tuple[str, str]:
    return function.__module__, function.__name__


def scale_numbers(value: ast.expr, factor: float) -> None:
    """Multiply the outermost numbers of an expression; whole ones stay whole, and 1 or more."""
    wanted = [value]
    while wanted:
        node = wanted.pop()
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            scaled = node.value * factor
            node.value = max(1, int(scaled + 0.5)) if isinstance(node.value, int) else scaled
        elif isinstance(node, ast.BinOp):
            wanted.append(node.left)
        elif isinstance(node, ast.UnaryOp):
            wanted.append(node.operand)
        elif isinstance(node, ast.Tuple | ast.List):
            wanted += node.elts
        elif isinstance(node, ast.Dict):
            wanted += node.values
        elif isinstance(node, ast.Call):
            wanted += node.args[:1]


def of_variant(
    sources: Sources, constant: Symbol, factor: float, folder: Path, before: dict[str, list[float]]
) -> dict[str, float] | None:
    """How the figures change, in a process of its own; None where it ends with an error."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        with os.fdopen(writing, "w") as answer:
            signal.alarm(MAX_SECONDS)
            scale_constant(sources, constant, factor)
            answer.write(json.dumps(changed(before, figures(folder))))
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as answer:
        text = answer.read()
    os.waitpid(child, 0)
    return json.loads(text) if text else None


def main(seed: int, only: str) -> None:
    """Print a line for each constant, and those that matter to nothing."""
    cv2.setNumThreads(0)  # a process with threads cannot be copied
    os.environ["PLANISH_THREADS"] = "1"
    tuned = [one for one in on_default_path() if one.kind == "tuned" and only in f"{one.module} {one.name}"]
    sources = Sources("restore")
    with tempfile.TemporaryDirectory() as scratch:
        folder, idle = Path(scratch), []
        draw(folder, seed)
        before = figures(folder)
        print(json.dumps({name: [round(one, 4) for one in some] for name, some in before.items()}), flush=True)
        for one in tuned:
            constant = one.module, one.name
            most = {}
            for factor in FACTORS:
                found = most[factor] = of_variant(sources, constant, factor, folder, before)
                if found is None or max(found.values()) > SAME:
                    break
            cells = (f"×{factor:g} " + _cell(found) for factor, found in most.items())
            print(f"{one.module[8:-3]} {one.name} = {one.value}: {'; '.join(cells)}", flush=True)
            if all(found is not None and max(found.values()) <= SAME for found in most.values()):
                idle.append(f"{one.module[8:-3]} {one.name}")
        print(f"\n{len(idle)} of {len(tuned)} change nothing by more than {SAME:.0%}:", *idle, sep="\n  ")


def _cell(found: dict[str, float] | None) -> str:
    if found is None:
        return "fails"
    name = max(found, key=lambda one: found[one])
    return f"{name} {found[name]:.1%}" if np.isfinite(found[name]) else f"{name} refused"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1128000)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    main(options.seed, options.only)
