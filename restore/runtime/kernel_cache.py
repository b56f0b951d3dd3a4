"""Chooses numba's cache folder: one for each state of the sources.

The sources are those of the kernels. numba looks at the file of a kernel alone, so it would not notice a change in a
kernel of another file that it calls; and it refuses to import a kernel where it can write neither next to the sources
nor in a home. `use_cache_folder` comes before numba is imported, and answers both with the name and the place of one
folder.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).parents[1]
VARIABLE = "NUMBA_CACHE_DIR"
NAME = "planish-kernels-"
KEPT_SECONDS = 30 * 86_400  # of folders for other sources: a branch or an installation may be used again
_IMPORT = re.compile(rb"^from restore\.([\w.]+) import", re.MULTILINE)


def use_cache_folder() -> None:
    """Make numba keep what it compiles in `cache_folder()`, here and in child processes."""
    folder = cache_folder()
    if numba := sys.modules.get("numba"):  # it has read the environment already, and reads it again when that changes
        numba.config.CACHE_DIR = str(folder)
    else:
        os.environ[VARIABLE] = str(folder)


def cache_folder() -> Path:
    """The folder for the compiled kernels.

    In this order, the first that can be written to: under NUMBA_CACHE_DIR where that is set, in the package, in the
    user's cache, in a temporary folder that is removed at exit. One outside the package begins with what is compiled
    inside, so that an administrator can compile for all users of a read-only installation.
    """
    name = NAME + stamp()
    compiled = PACKAGE / "__pycache__" / name
    for base in _bases(compiled.parent):
        folder = base / name
        if _can_write(base):
            if not folder.exists():
                _remove_old(base)
                _copy(compiled, folder)
            if _can_write(folder):
                return folder
    raise RuntimeError("unreachable: a temporary folder can be written to")


def stamp() -> str:
    """Changes with every file that kernels are compiled from."""
    digest = hashlib.sha256()
    for _, text in sorted(kernel_sources().items()):
        digest.update(hashlib.sha256(text).digest())
    return digest.hexdigest()[:16]


def kernel_sources() -> dict[str, bytes]:
    """Return the files that hold kernels, and all of the package that those import.

    Constants of imported modules are compiled into kernels, so these files count although they may hold no kernel.
    """
    files = dict(_python_files(str(PACKAGE)))
    waiting = [path for path, text in files.items() if b"import numba" in text]
    reached: dict[str, bytes] = {}
    while waiting:
        path = waiting.pop()
        if path in files and path not in reached:
            reached[path] = files[path]
            for module in _IMPORT.findall(files[path]):
                place = os.path.join(PACKAGE, *module.decode().split("."))  # noqa: PTH118 - a third of Path's time
                waiting += [f"{place}.py", os.path.join(place, "__init__.py")]  # noqa: PTH118
    return reached


def _python_files(folder: str) -> Iterator[tuple[str, bytes]]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(".py"):
                with open(entry.path, "rb") as file:  # noqa: PTH123
                    yield entry.path, file.read()
            elif entry.is_dir() and entry.name != "__pycache__":
                yield from _python_files(entry.path)


def _bases(package: Path) -> Iterator[Path]:
    """Where the folder may be, the best first."""
    if named := os.environ.get(VARIABLE):
        place = Path(named)
        yield place.parent if place.name.startswith(NAME) else place  # a process that started this one chose it
    yield package
    users = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # noqa: PTH111 - Path raises without a home
    if os.path.isabs(users):  # noqa: PTH117 - as it may be no path
        yield Path(users) / "planish"
    yield _temporary()


def _temporary() -> Path:
    import shutil
    import tempfile

    folder = tempfile.mkdtemp(prefix="planish-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def _can_write(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _remove_old(base: Path) -> None:
    import shutil  # takes as long as all the rest of this module, and is rarely needed

    for folder in base.glob(f"{NAME}*"):
        if folder.stat().st_mtime < time.time() - KEPT_SECONDS:
            shutil.rmtree(folder, ignore_errors=True)


def _copy(compiled: Path, folder: Path) -> None:
    """Copy a folder so that another process sees all of it or nothing.

    Files that cannot be copied are compiled.
    """
    if not compiled.is_dir():
        return
    import shutil
    import tempfile

    with suppress(OSError), tempfile.TemporaryDirectory(dir=folder.parent, ignore_cleanup_errors=True) as half:
        for file in compiled.glob("*/*"):
            place = Path(half, "whole", file.relative_to(compiled))
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, place)
        Path(half, "whole").rename(folder)


@contextmanager
def notify_when_compiling(notify: Callable[[], None]) -> Iterator[None]:
    """Call notify() whenever a kernel has to be compiled in the block.

    It is called as the compilation begins.
    """
    from numba.core import event  # imported with the first kernel, not with the package

    class Listener(event.Listener):
        def on_start(self, _event: Any) -> None:
            notify()

        def on_end(self, _event: Any) -> None:
            """Nothing."""

    with event.install_listener("numba:compile", Listener()):
        yield
