"""Compiled kernels are kept where they can be, found again, and made anew when anything that they use has changed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core import config

from restore.runtime import kernel_cache
from restore.runtime.kernel_cache import KernelLocator, folder_for, imported, stamp

# A package `restore` of one kernel that calls another, in another file, with a constant of a third.
SOURCES = {
    "restore/__init__.py": "import restore.runtime.kernel_cache\n",
    "restore/runtime/__init__.py": "",
    "restore/settings.py": "OFFSET = 40\n",
    "restore/inner.py": "import numba\nfrom restore.settings import (\n    OFFSET,\n)\n\n@numba.njit(cache=True)\n"
    "def inner(x):\n    return x + OFFSET\n",
    "restore/outer.py": "import numba\nfrom restore.inner import inner\n\n@numba.njit(cache=True)\n"
    "def outer(x):\n    return inner(x) + 1\n",
    "run.py": "from restore.runtime import kernel_cache\ncompiled = []\n"
    "with kernel_cache.notify_when_compiling(lambda: compiled.append(1)):\n"
    "    from restore.outer import outer\n    print(outer(1), len(compiled))\n",
}


@pytest.fixture
def tree(tmp_path) -> Path:
    """A small installation."""
    root = tmp_path / "site"
    for name, text in SOURCES.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    (root / "restore/runtime/kernel_cache.py").write_bytes(Path(kernel_cache.__file__).read_bytes())
    return root


def run(root: Path, home: Path, **variables: str) -> tuple[int, int]:
    """What the outer kernel answers to 1 in a process of its own, and how many functions were compiled for it."""
    kept = {name: os.environ[name] for name in ("PATH", "TMPDIR") if name in os.environ}
    environment = kept | {"HOME": str(home), "PYTHONDONTWRITEBYTECODE": "1"} | variables
    done = subprocess.run(
        [sys.executable, root / "run.py"], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    value, compiled = map(int, done.stdout.split())
    return value, compiled


def compiled_in(folder: Path) -> set[str]:
    return {path.name.partition("-")[0] for path in folder.rglob("*.nbi")}


def no_folder_beside(root: Path) -> None:
    """Make it impossible to write beside the sources, for root as well: a file is where the folder would be."""
    (root / "restore/__pycache__").write_text("not a folder")


def test_kernels_are_kept_beside_the_sources_and_found_again(tree, tmp_path):
    first = run(tree, tmp_path / "home")
    assert (first[0], first[1] > 0) == (42, True)
    assert compiled_in(tree / "restore/__pycache__") == {"inner.inner", "outer.outer"}
    assert run(tree, tmp_path / "home") == (42, 0)
    assert not (tmp_path / "home").exists()


@pytest.mark.parametrize(
    ("file", "old", "new", "value"),
    [
        ("restore/inner.py", "x + OFFSET", "x - OFFSET", -38),
        ("restore/settings.py", "40", "50", 52),
        ("restore/outer.py", "+ 1", "+ 2", 43),
    ],
)
def test_a_change_in_a_file_that_a_kernel_uses_is_noticed(tree, tmp_path, file, old, new, value):
    run(tree, tmp_path / "home")
    text = (tree / file).read_text()
    (tree / file).write_text(text.replace(old, new))
    assert run(tree, tmp_path / "home")[0] == value


def test_an_installation_that_cannot_be_written_to_uses_the_users_cache(tree, tmp_path):
    no_folder_beside(tree)
    assert run(tree, tmp_path / "home")[0] == 42
    assert compiled_in(tmp_path / "home/.cache/planish") == {"inner.inner", "outer.outer"}
    assert run(tree, tmp_path / "home") == (42, 0)


def test_without_a_home_nothing_is_kept_and_all_works(tree, tmp_path):
    no_folder_beside(tree)
    (tmp_path / "home").write_text("not a folder")
    (tmp_path / "tmp").mkdir()
    assert run(tree, tmp_path / "home", TMPDIR=str(tmp_path / "tmp"))[0] == 42
    assert list((tmp_path / "tmp").iterdir()) == []


def test_a_folder_that_the_user_names_comes_first(tree, tmp_path):
    assert run(tree, tmp_path / "home", NUMBA_CACHE_DIR=str(tmp_path / "named"))[0] == 42
    assert compiled_in(tmp_path / "named") == {"inner.inner", "outer.outer"}
    assert compiled_in(tree) == set()


def test_what_is_compiled_beside_the_sources_is_where_others_begin(tree, tmp_path):
    run(tree, tmp_path / "home")  # as the administrator who installs it
    assert run(tree, tmp_path / "home", NUMBA_CACHE_DIR=str(tmp_path / "own")) == (42, 0)
    (tree / "restore/settings.py").write_text("OFFSET = 60\n")  # and who brings it up to date
    run(tree, tmp_path / "home")
    assert run(tree, tmp_path / "home", NUMBA_CACHE_DIR=str(tmp_path / "own")) == (62, 0)


def test_a_named_folder_that_cannot_be_made_is_passed_over(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "file" / "folder"))
    sources = Path(kernel_cache.__file__).parent
    assert folder_for.__wrapped__(sources) == sources / "__pycache__"


def test_kernels_of_others_are_left_to_numba(tmp_path):
    other = tmp_path / "other.py"
    other.write_text("")
    assert KernelLocator.from_function(run, str(other)) is None


def test_every_import_of_a_kernel_counts_for_its_stamp(repository):
    root = repository / "restore"
    assert {root / "prepared/prepare.py", root / "scan.py"} <= imported(root / "pipeline.py")
    assert imported(root / "errors.py") == frozenset()
    assert stamp(root / "mesh/raster.py") != stamp(root / "mesh/pose.py")
