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
    "drivers.simulated.device.stage.controller",
    "drivers.simulated.imaging.illumination",
    "drivers.simulated.imaging.shot_data",
    "drivers.simulated.scene.artwork.typeset",
    "drivers.simulated.scene.sheets.rulings",
    "drivers.vivid900.capture.shot_parameters",
    "restore.flattening.solution",
    "restore.formats.clouds.e57_process",  # in a process of its own
    "restore.formats.gltf.trimesh_parser",
    "restore.photo.dense",
    "restore.photo.features",
    "restore.photo.reference",
    "restore.photo.sources",
    "restore.turntable.view",
    "station.colour.run",
    "station.commands.devices",
    "station.commands.export",
}


def sources() -> list[Path]:
    """All files of the packages."""
    return [path for package in PACKAGES for path in package.rglob("*.py")]


@cache
def modules() -> dict[str, Path]:
    found = (path for path in sources() if not path.stem.startswith("__"))
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


@cache
def imported_by_tests() -> dict[str, set[str]]:
    """Module or package → the names that tests import from it."""
    found: dict[str, set[str]] = {}
    for test in TESTS.rglob("test_*.py"):
        for source, name in imports(test):
            found.setdefault(source, set()).add(name)
    return found


@cache
def names_of_tests() -> frozenset[str]:
    return frozenset(test.stem for test in TESTS.rglob("test_*.py"))


def is_tested(module: str) -> bool:
    """Whether a test has the module's name, imports it, or imports a name of it through the door of its package."""
    path, imported = modules()[module], imported_by_tests()
    if f"test_{path.stem}" in names_of_tests() or module in imported:
        return True
    parts = module.split(".")
    if parts[-1] in imported.get(".".join(parts[:-1]), ()):
        return True
    doors = (imported.get(".".join(parts[:end]), set()) for end in range(1, len(parts)))
    return any(door & defined_names(path) for door in doors)


def test_every_module_has_a_test():
    assert {module for module in modules() if not is_tested(module)} - CALLED_BY_OTHERS == set()


def test_the_list_of_exceptions_names_only_modules_that_need_one():
    assert modules().keys() >= CALLED_BY_OTHERS
    assert {module for module in CALLED_BY_OTHERS if is_tested(module)} == set()


def import_graph() -> dict[str, set[str]]:
    """Module or package → those that it imports, anywhere in it: for type checking alone and inside functions, too."""
    files = {}
    for path in sources():
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


SCANS = {"RangeScan", "SurfaceMesh", "ScannedSheet", "Prepared"}  # and all that derive from them
# Where a branch on the kind of a scan may be, besides `restore/prepared/`. The list may only become shorter.
MAY_ASK = {
    "restore/mesh/validate.py",  # a mesh that was made valid is not made so again
    "station/archive/sheets.py",  # the surface of any scan
    "station/commands/calibrate.py",  # a mesh was given where only a range image serves, as in the four below
    "station/run/one_page.py",
    "station/run/pieces.py",
    "station/run/scale.py",
    "station/run/shots.py",
    "station/run/turntable.py",
    "station/console/shown_pages/models.py",  # what the page draws of it
    "station/verdict/measures.py",  # a measure that only a range image has
}


@cache
def kinds_of_scans() -> frozenset[str]:
    """Names of the classes of scans, sheets and prepared pages."""
    bases: dict[str, set[str]] = {}
    for path in sources():
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ClassDef):
                bases.setdefault(node.name, set()).update(ast.unparse(base).split("[")[0] for base in node.bases)
    found = set(SCANS)
    while more := {name for name, above in bases.items() if above & found} - found:
        found |= more
    return frozenset(found)


def asks_for_kind(source: str) -> bool:
    """Whether code branches on the kind of a scan: isinstance, issubclass, type(…) or a class in `match`."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("isinstance", "issubclass"):
            looked_at: list[ast.AST] = [*node.args[1:]]
        elif isinstance(node, ast.Compare) and "type(" in ast.unparse(node):
            looked_at = [node]
        elif isinstance(node, ast.MatchClass):
            looked_at = [node.cls]
        else:
            continue
        names = {one.id for part in looked_at for one in ast.walk(part) if isinstance(one, ast.Name)}
        if names & kinds_of_scans():
            return True
    return False


def test_only_preparing_asks_for_the_kind_of_a_scan():
    root = TESTS.parent
    asking = {str(path.relative_to(root)) for path in sources() if asks_for_kind(path.read_text("utf-8"))}
    assert {name for name in asking if not name.startswith("restore/prepared/")} == MAY_ASK


@pytest.mark.parametrize(
    "source",
    [
        "isinstance(scan, RangeScan)",
        "isinstance(page, (int, FacetSheet))",
        "type(page) is not FacetSheet",
        "match scan:\n case SurfaceMesh():\n  pass",
    ],
)
def test_a_question_for_the_kind_is_found(source):
    assert asks_for_kind(source)
    assert not asks_for_kind(
        source.replace("RangeScan", "str").replace("FacetSheet", "str").replace("SurfaceMesh", "str")
    )


@pytest.mark.parametrize(("package", "most"), [("restore", 14), ("station", 10), ("drivers", 4)])
def test_the_root_of_a_package_stays_small(package, most):
    """What belongs together has a folder of its own."""
    assert len(list((TESTS.parent / package).glob("*.py"))) <= most


def test_only_the_test_of_the_bench_imports_the_bench():
    files = [
        path for path in TESTS.rglob("*.py") if any(source.split(".")[0] == "bench" for source, _ in imports(path))
    ]
    assert [path.name for path in files] == ["test_bench.py"]
