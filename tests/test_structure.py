"""Every module has a test file of its own name, or a test that imports it; tests need no bench."""

from __future__ import annotations

import ast
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
PACKAGES = [TESTS.parent / name for name in ("drivers", "restore", "station")]

# No test calls these directly; they run in the tests of the modules that use them. The list may only become shorter.
CALLED_BY_OTHERS = {
    "drivers.safety.device_context",
    "drivers.shipped",
    "drivers.simulated.device.stage.controller",
    "drivers.simulated.imaging.illumination",
    "drivers.simulated.imaging.shot_data",
    "drivers.simulated.scene.artwork.typeset",
    "drivers.simulated.scene.sheets.rulings",
    "drivers.vivid900.capture.shot_parameters",
    "restore.flattening.solution",
    "restore.formats.trimesh_parser",
    "restore.photo.dense",
    "restore.photo.features",
    "restore.photo.reference",
    "restore.photo.sources",
    "restore.turntable.view",
    "station.colour.run",
    "station.commands.devices",
    "station.commands.export",
}


@cache
def modules() -> dict[str, Path]:
    found = (path for package in PACKAGES for path in package.rglob("*.py") if not path.stem.startswith("__"))
    return {".".join(path.relative_to(TESTS.parent).with_suffix("").parts): path for path in found}


@cache
def imports(path: Path) -> frozenset[tuple[str, str]]:
    """(module, name) of every `from module import name` of a file; the name is empty for `import module`."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {(alias.name, "") for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {(node.module, alias.name) for alias in node.names}
    return frozenset(found)


@cache
def defined_names(path: Path) -> frozenset[str]:
    body = ast.parse(path.read_text("utf-8")).body
    return frozenset(node.name for node in body if isinstance(node, ast.FunctionDef | ast.ClassDef))


def is_tested(module: str) -> bool:
    """Whether a test has the module's name, imports it, or imports a name of it through the door of its package."""
    path = modules()[module]
    for test in TESTS.rglob("test_*.py"):
        if test.stem == f"test_{path.stem}":
            return True
        for source, name in imports(test):
            through_door = module.startswith(f"{source}.") and name in defined_names(path)
            if module in (source, f"{source}.{name}") or through_door:
                return True
    return False


def test_every_module_has_a_test():
    assert {module for module in modules() if not is_tested(module)} - CALLED_BY_OTHERS == set()


def test_the_list_of_exceptions_names_only_modules_that_need_one():
    assert modules().keys() >= CALLED_BY_OTHERS
    assert {module for module in CALLED_BY_OTHERS if is_tested(module)} == set()


def import_graph() -> dict[str, set[str]]:
    """Module or package → those that it imports, anywhere in it: for type checking alone and inside functions, too."""
    files = {}
    for path in (path for package in PACKAGES for path in package.rglob("*.py")):
        parts = path.relative_to(TESTS.parent).with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    graph: dict[str, set[str]] = {module: set() for module in files}
    for module, path in files.items():
        for source, name in imports(path):
            named = f"{source}.{name}" if f"{source}.{name}" in files else source
            graph[module] |= {named} & files.keys() - {module}
    return graph


def test_no_imports_run_in_a_circle():
    TopologicalSorter(import_graph()).prepare()


def test_a_circle_is_found():
    graph = import_graph()
    graph["restore.scan"] = {"restore.pipeline"}
    with pytest.raises(CycleError):
        TopologicalSorter(graph).prepare()


@pytest.mark.parametrize(("package", "most"), [("restore", 14), ("station", 10), ("drivers", 4)])
def test_the_root_of_a_package_stays_small(package, most):
    """What belongs together has a folder of its own."""
    assert len(list((TESTS.parent / package).glob("*.py"))) <= most


def test_only_the_test_of_the_bench_imports_the_bench():
    files = [
        path for path in TESTS.rglob("*.py") if any(source.split(".")[0] == "bench" for source, _ in imports(path))
    ]
    assert [path.name for path in files] == ["test_bench.py"]
