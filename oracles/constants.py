"""The named constants of modules, with their values and reasons as the source gives them."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
# What the default method runs through on a mesh, from its lengths to the page.
ENGINE = tuple(
    f"restore/{name}.py"
    for name in (
        *("mesh/jets", "mesh/decimation_bias", "mesh/surface_lengths", "mesh/network", "mesh/pose", "mesh/measures"),
        *("flattening/isometric/fan_orientation", "flattening/isometric/fans"),
        *("flattening/isometric/angle_synchronisation", "flattening/conformal"),
        *("flattening/isometric/gauss_newton", "flattening/isometric/preconditioner"),
        *("flattening/isometric/page", "flattening/isometric/two_lengths"),
        *("flattening/isometric/repair", "flattening/isometric/least_distortion"),
        *("flattening/joints", "flattening/layout", "flattening/methods"),
    )
)


class Constant(NamedTuple):
    """A constant: its name, its value as it is written, and the comment beside it or above it."""

    name: str
    value: str
    reason: str


def constants_of(path: Path) -> Iterator[Constant]:
    """The numbers of a module in their order: names in capitals at its top level, but those that follow from others."""
    text = path.read_text("utf-8")
    lines = text.split("\n")
    for node in ast.parse(text).body:
        if not isinstance(node, ast.Assign):
            continue
        (target,) = node.targets
        names, values = (part.elts if isinstance(part, ast.Tuple) else [part] for part in (target, node.value))
        if len(names) != len(values):
            continue
        for name, value in zip(names, values, strict=True):
            written = ast.unparse(value)
            if isinstance(name, ast.Name) and name.id.isupper() and re.search(r"\d", written):
                yield Constant(name.id, written, _comment(lines, node))


def _comment(lines: list[str], node: ast.Assign) -> str:
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
