"""Compiled kernels are kept where they can be, found again, and made anew when anything that they use has changed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from restore.runtime import kernel_cache
from restore.runtime.kernel_cache import cache_folder, kernel_sources, stamp

pytestmark = pytest.mark.slow

# A package `restore` of one kernel that calls another, in another file, with a constant of a third.
SOURCES = {
    "restore/__init__.py": "from restore.runtime.kernel_cache import use_cache_folder\nuse_cache_folder()\n",
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
KERNELS = {"inner.inner", "outer.outer"}


@pytest.fixture
def tree(tmp_path, monkeypatch) -> Path:
    """A small installation, which is also the one that the functions of this process look at."""
    root = tmp_path / "site"
    for name, text in SOURCES.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    (root / "restore/runtime/kernel_cache.py").write_bytes(Path(kernel_cache.__file__).read_bytes())
    monkeypatch.setattr(kernel_cache, "PACKAGE", root / "restore")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
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


def make_read_only(root: Path) -> None:
    """Make it impossible to write beside the sources, for root as well: a file is where the folder would be."""
    (root / "restore/__pycache__").write_text("not a folder")


def test_kernels_are_kept_in_the_package_and_found_again(tree, tmp_path):
    first = run(tree, tmp_path / "home")
    assert (first[0], first[1] > 0) == (42, True)
    assert compiled_in(tree / "restore/__pycache__") == KERNELS
    assert run(tree, tmp_path / "home") == (42, 0)
    assert not (tmp_path / "home").exists()


def test_a_change_in_a_file_that_a_kernel_uses_is_noticed(tree, tmp_path):
    run(tree, tmp_path / "home")
    changes = (("inner", "x + OFFSET", "x - OFFSET", -38), ("settings", "40", "50", -48), ("outer", "+ 1", "+ 2", -47))
    for name, old, new, value in changes:
        file = tree / f"restore/{name}.py"
        file.write_text(file.read_text().replace(old, new))
        assert run(tree, tmp_path / "home")[0] == value


def test_an_installation_that_cannot_be_written_to_uses_the_users_cache(tree, tmp_path):
    make_read_only(tree)
    assert run(tree, tmp_path / "home")[0] == 42
    assert compiled_in(tmp_path / "home/.cache/planish") == KERNELS
    assert run(tree, tmp_path / "home") == (42, 0)


def test_without_a_home_nothing_is_kept_and_all_works(tree, tmp_path):
    make_read_only(tree)
    (tmp_path / "home").write_text("not a folder")
    (tmp_path / "tmp").mkdir()
    assert run(tree, tmp_path / "home", TMPDIR=str(tmp_path / "tmp"))[0] == 42
    assert list((tmp_path / "tmp").iterdir()) == []


def test_what_is_compiled_in_the_package_is_where_others_begin(tree, tmp_path):
    run(tree, tmp_path / "home")  # as the administrator who installs it
    own = {"NUMBA_CACHE_DIR": str(tmp_path / "own")}  # a folder that the user names comes first
    assert run(tree, tmp_path / "home", **own) == (42, 0)
    assert compiled_in(tmp_path / "own") == KERNELS
    (tree / "restore/settings.py").write_text("OFFSET = 60\n")  # and who brings it up to date
    run(tree, tmp_path / "home")
    assert run(tree, tmp_path / "home", **own) == (62, 0)


def test_a_folder_that_the_user_names_comes_first(tree, tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "named"))
    chosen = cache_folder()
    assert chosen.parent == tmp_path / "named"
    assert not (tree / "restore/__pycache__").exists()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(chosen))
    assert cache_folder() == chosen  # as in a process that this one started


def test_a_named_folder_that_cannot_be_made_is_passed_over(tree, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "folder"))
    assert cache_folder().parent == tree / "restore/__pycache__"


def test_numba_that_was_imported_before_uses_the_folder_too(tree, tmp_path):
    (tree / "run.py").write_text(f"import numba\n{SOURCES['run.py']}")
    assert run(tree, tmp_path / "home")[0] == 42
    folders = [path.parent.parent.name for path in tree.rglob("*.nbi")]
    assert len(folders) == len(KERNELS)
    assert set(folders) == {kernel_cache.NAME + stamp()}


def test_folders_of_other_sources_are_removed_when_they_are_old(tree):
    old, recent = (tree / f"restore/__pycache__/{kernel_cache.NAME}{name}" for name in ("old", "recent"))
    for folder in (old, recent):
        folder.mkdir(parents=True)
    os.utime(old, (0, 0))
    assert cache_folder().parent == old.parent
    assert (old.exists(), recent.exists()) == (False, True)


def test_every_import_of_a_kernel_counts_for_the_stamp(repository):
    code = "import sys, restore.flattening.isometric.gauss_newton; print(*(m.__file__ for m in sys.modules.values() "
    code += "if m.__name__.startswith('restore.')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    packages = {str(path) for path in (repository / "restore").rglob("__init__.py")}
    used = set(done.stdout.split()) - packages - {kernel_cache.__file__}
    assert {str(repository / f"restore/{name}.py") for name in ("numerics/limits", "scan")} <= used
    assert used <= set(kernel_sources())
    assert str(repository / "restore/pipeline.py") not in kernel_sources()  # no kernel depends on it
