"""A command imports what it runs: the modules of other work stay out of a process that restores a scan."""

from __future__ import annotations

import subprocess
import sys

import pytest

import restore
from restore import runtime

# Each takes longer to import than all that a stored scan needs beside numba.
OTHER_WORK = ("scipy.stats", "scipy.optimize", "trimesh", "open3d", "pymeshlab", "restore.photogrammetry.reconstruct")


def modules_after(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(*sys.modules)"
    return set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())


LIGHT = "import restore, restore.scan, restore.files, restore.runtime"


def test_importing_the_package_imports_none_of_its_work():
    assert modules_after(LIGHT).isdisjoint({"cv2", "numba", "scipy", "restore.pipeline"})


def test_a_scan_without_a_phones_capture_needs_no_photogrammetry():
    statement = "from restore import load_capture; from contextlib import suppress\nwith suppress(Exception): "
    assert "restore.photogrammetry" not in modules_after(statement + "load_capture('gone.obj')")


@pytest.mark.parametrize("statement", ["from restore import load_scan, restore", "import station.run.one_page"])
def test_restoring_a_stored_scan_imports_nothing_of_other_work(statement):
    assert modules_after(statement).isdisjoint(OTHER_WORK)


def test_the_public_api_has_sixteen_functions_fifteen_types_and_three_errors():
    names = {name: getattr(restore, name) for name in restore.__all__}
    errors = {name for name, one in names.items() if isinstance(one, type) and issubclass(one, Exception)}
    types = {name for name, one in names.items() if isinstance(one, type)} - errors
    assert (len(names.keys() - types - errors), len(types), len(errors)) == (16, 15, 3)


def test_the_runtime_package_lists_its_names():
    assert all(getattr(runtime, name) is not None for name in runtime.__all__)
    assert "missing_libraries" in runtime.__all__


def test_every_public_name_can_be_imported_and_is_listed():
    assert all(getattr(restore, name) is not None for name in restore.__all__)
    assert set(restore.__all__) <= set(dir(restore))
    assert callable(restore.restore)  # not the package of the same name


def test_a_name_that_is_not_public_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no_such_name"):
        restore.no_such_name  # noqa: B018
