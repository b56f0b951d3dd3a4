"""Keeps compiled kernels between runs where numba's own rules do not: across changes, and in read-only installations.

numba looks at the file of a kernel alone, so a change in a kernel of another file that it calls goes unnoticed; and it
refuses to import a kernel where it can write neither beside the sources nor in a home. Once this module is imported,
numba asks here first about the kernels of these packages; all others it looks after itself, as before.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, Self

from numba.core import config, event
from numba.core.caching import CacheImpl

ROOT = Path(__file__).parents[2]
PACKAGES = ("drivers", "restore", "station")
INDEX = ".nbi"  # numba's file of what is compiled of one kernel; what is compiled is beside it
_IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|.*)|import[ \t]+([\w.]+))", re.MULTILINE
)


class KernelLocator:
    """Where the compiled code of one kernel is kept, and the stamp of the sources it was made of: numba's protocol."""

    def __init__(self, kernel: FunctionType, source: Path) -> None:
        self._py_file = str(source)  # numba's messages name it
        self._source, self._line = source, kernel.__code__.co_firstlineno

    @classmethod
    def from_function(cls, kernel: FunctionType, file: str) -> Self | None:
        """A locator for a kernel of these packages; None for those of others, which numba looks after itself."""
        source = Path(file)
        ours = any(source.is_relative_to(ROOT / package) for package in PACKAGES)
        return cls(kernel, source) if ours and source.is_file() else None

    def get_cache_path(self) -> str:
        """The folder."""
        return str(folder_for(self._source.parent))

    def ensure_cache_path(self) -> None:
        """Make the folder."""
        folder_for(self._source.parent).mkdir(parents=True, exist_ok=True)

    def get_source_stamp(self) -> str:
        """Changes with all that the kernel is compiled from."""
        return stamp(self._source)

    def get_disambiguator(self) -> str:
        """Tells kernels of the same name in one file apart."""
        return str(self._line)


@cache
def stamp(source: Path) -> str:
    """SHA-256 over a source file and all files of these packages that it imports, directly or through others.

    Constants of imported modules are compiled into kernels, so these files count although they may hold no kernel.
    """
    reached, waiting = {source}, [source]
    while waiting:
        new = imported(waiting.pop()) - reached
        reached |= new
        waiting += new
    digest = hashlib.sha256()
    for file in sorted(reached):
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


@cache
def imported(source: Path) -> frozenset[Path]:
    """The files of these packages that a source file imports by name."""
    files = set()
    for module, names, plain in _IMPORT.findall(source.read_text("utf-8")):
        modules = [plain] if plain else [module, *(f"{module}.{name}" for name in re.findall(r"\w+", names))]
        files |= {file for file in map(_file_of, modules) if file is not None}
    return frozenset(files - {source})


@cache
def _file_of(module: str) -> Path | None:
    if module.partition(".")[0] not in PACKAGES:
        return None
    place = ROOT.joinpath(*module.split("."))
    candidates = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)


@cache
def folder_for(sources: Path) -> Path:
    """The folder for the compiled kernels of one folder of sources.

    In this order, the first that can be written to: under NUMBA_CACHE_DIR where that is set, beside the sources, in the
    user's cache, in a temporary folder that is removed at exit. One that is not beside the sources begins with what is
    compiled there, so that an administrator can compile for all users of a read-only installation.
    """
    beside = sources / "__pycache__"
    for base in _bases():
        folder = beside if base is None else base / str(sources.relative_to(ROOT))
        if _can_write(folder):
            if folder != beside:
                _begin_with(beside, folder)
            return folder
    raise RuntimeError("unreachable: a temporary folder can be written to")


def _bases() -> Iterator[Path | None]:
    """Where to keep what is compiled, the best first; None is beside the sources."""
    here = hashlib.sha256(str(ROOT).encode()).hexdigest()[:16]  # installations do not get into each other's way
    if config.CACHE_DIR:
        yield Path(config.CACHE_DIR) / f"planish-{here}"
    yield None
    users = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # noqa: PTH111 - Path raises without a home
    if os.path.isabs(users):  # noqa: PTH117 - as it may be no path
        yield Path(users) / "planish" / f"kernels-{here}"
    yield Path(_temporary().name)


@cache
def _temporary() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="planish-kernels-")


def _can_write(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _begin_with(compiled: Path, folder: Path) -> None:
    """Copy what is compiled beside the sources, where that is newer than what the folder has."""
    for index in compiled.glob(f"*{INDEX}"):
        mine = folder / index.name
        if not mine.exists() or mine.stat().st_mtime < index.stat().st_mtime:
            for file in (*compiled.glob(f"{index.stem}.*.nbc"), index):  # the index last: it names the others
                _copy(file, folder / file.name)


def _copy(source: Path, target: Path) -> None:
    """Copy a file so that another process sees all of it or nothing."""
    with tempfile.NamedTemporaryFile(dir=target.parent, delete=False) as file:
        file.write(source.read_bytes())
    shutil.move(file.name, target)


@contextmanager
def notify_when_compiling(notify: Callable[[], None]) -> Iterator[None]:
    """Call notify() whenever a kernel has to be compiled while the block runs, as it begins."""

    class Listener(event.Listener):
        def on_start(self, _event: Any) -> None:
            notify()

        def on_end(self, _event: Any) -> None:
            """Nothing."""

    with event.install_listener("numba:compile", Listener()):
        yield


CacheImpl._locator_classes.insert(0, KernelLocator)
