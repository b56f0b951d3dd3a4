"""Loads open3d and pymeshlab when they are first used.

Their wheels need libraries that only the system has.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import ModuleType

from restore.errors import LibraryMissing


@dataclass(frozen=True)
class SystemLibrary:
    """A shared library that a wheel takes from the system.

    file     its name for the dynamic linker.
    package  the package of Debian and Ubuntu that holds it.
    module   the Python module that needs it.
    work     what cannot be done without it.
    always   whether every restoration needs it.
    """

    file: str
    package: str
    module: str
    work: str
    always: bool = True


# Without libOpenGL pymeshlab is imported all the same, but lacks the plug-in that decimates.
SYSTEM_LIBRARIES = (
    SystemLibrary("libEGL.so.1", "libegl1", "open3d", "simulated scans and the merging of views", always=False),
    SystemLibrary("libGL.so.1", "libgl1", "pymeshlab", "restorations"),
    SystemLibrary("libOpenGL.so.0", "libopengl0", "pymeshlab", "restorations"),
)

Loadable = Callable[[str], bool]
"""Whether the dynamic linker can load a shared library of this name."""


def loadable(file: str) -> bool:
    """Whether the dynamic linker can load a shared library of this name; it stays loaded."""
    try:
        ctypes.CDLL(file)
    except OSError:
        return False
    return True


def missing_libraries(can_load: Loadable = loadable) -> list[SystemLibrary]:
    """Return those of SYSTEM_LIBRARIES that the system lacks.

    On systems other than Linux the wheels have all they need.
    """
    if sys.platform != "linux":
        return []
    return [library for library in SYSTEM_LIBRARIES if not can_load(library.file)]


def load(module: str, can_load: Loadable = loadable) -> ModuleType:
    """Import open3d or pymeshlab.

    Raises LibraryMissing, with the Debian packages that it lacks.
    """
    missing = [library for library in missing_libraries(can_load) if library.module == module]
    if missing:
        packages = " ".join(library.package for library in missing)
        raise LibraryMissing(
            f"{module} needs {' and '.join(library.file for library in missing)} of the system, which is not installed",
            f"install it: sudo apt install {packages} (Debian, Ubuntu)",
        )
    try:
        return import_module(module)
    except (ImportError, OSError) as error:
        first = str(error).splitlines()[0]
        hint = f"python3 -m pip install --force-reinstall {module}; `planish doctor` shows what else is missing"
        raise LibraryMissing(f"{module} cannot be loaded: {first}", hint) from error


@cache
def load_pymeshlab() -> ModuleType:
    """Return pymeshlab. Raises LibraryMissing.

    A program whose threads use it loads it in its main thread: what it took in a thread that has ended it frees at the
    end of the process, and the C library aborts.
    """
    return load("pymeshlab")


@cache
def load_open3d() -> ModuleType:
    """Import open3d, printing errors only.

    The libusb that it expects from the system comes from the libusb-package wheel. Raises LibraryMissing.
    """
    import libusb_package

    ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
    open3d = load("open3d")
    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    return open3d
