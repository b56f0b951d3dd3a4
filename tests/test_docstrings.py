"""Every public function that takes or returns arrays says their shapes."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("drivers", "restore", "station")
ARRAYS = re.compile(r"\b(Floats|Ints|Bytes|Mask|Field|PageMap|Picture|NDArray|ndarray)\b")
# (n, 3), (m,), (rows, cols), (…, 2), (3·m, k): names, numbers and products between parentheses, with a comma.
# (…) is any shape. What implements a protocol may refer to it.
SHAPE = re.compile(r"\((?:[\w·…+−* ]+,)+[\w·…+−* ]*\)|\(…\)|\bSee [A-Z]\w+")


def public_functions(path: Path) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Functions of a module and methods of its public classes, without private ones and overloads of a protocol."""
    module = ast.parse(path.read_text("utf-8"))
    holders: list[tuple[str, list[ast.stmt]]] = [("", module.body)]
    holders += [(f"{node.name}.", node.body) for node in module.body if isinstance(node, ast.ClassDef)]
    for prefix, body in holders:
        for node in body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_") and not prefix.startswith("_"):
                yield prefix + node.name, node


def has_arrays(function: ast.FunctionDef) -> bool:
    arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    annotations = [argument.annotation for argument in arguments] + [function.returns]
    return any(node is not None and ARRAYS.search(ast.unparse(node)) for node in annotations)


def without_shapes() -> list[str]:
    found = []
    for path in sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        for name, function in public_functions(path):
            if has_arrays(function) and not SHAPE.search(ast.get_docstring(function) or ""):
                found.append(f"{path.relative_to(ROOT)}:{function.lineno} {name}")
    return found


def test_public_functions_say_the_shapes_of_their_arrays():
    assert without_shapes() == []


def test_a_shape_is_distinguished_from_other_parentheses():
    assert all(SHAPE.search(text) for text in ("(n, 3) mm", "(m,)", "(rows, cols)", "(…, 2)", "(3·m, k)"))
    assert not any(SHAPE.search(text) for text in ("(Canny 1986)", "f(x)", "(mm)"))
