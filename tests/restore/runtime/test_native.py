"""Native libraries that the system lacks: the error names the package, and what does not need them works."""

from __future__ import annotations

import subprocess
import sys

import pytest

from restore.errors import LibraryMissing
from restore.runtime.native import SYSTEM_LIBRARIES, load, loadable, missing_libraries

linux_only = pytest.mark.skipif(sys.platform != "linux", reason="wheels for other systems bring their libraries")

# As on a system that has none of them: the import system finds no open3d and no pymeshlab at all.
WITHOUT_THEM = """
import sys
sys.modules["open3d"] = sys.modules["pymeshlab"] = None
import drivers, drivers.simulated, drivers.vivid900.discovery, restore, restore.turntable, station.cli
from pathlib import Path
import numpy as np
from restore import load_scan
corners = "v 0 0 0\\nv 100 0 0\\nv 0 100 0\\nf 1 2 3\\n"
Path(sys.argv[1]).write_text(corners)
assert len(load_scan(Path(sys.argv[1])).vertices) == 3
"""


@linux_only
def test_a_missing_library_is_named_with_its_package():
    with pytest.raises(LibraryMissing, match=r"pymeshlab needs libGL\.so\.1 and libOpenGL\.so\.0") as caught:
        load("pymeshlab", lambda _: False)
    assert "apt install libgl1 libopengl0" in caught.value.hint


@linux_only
@pytest.mark.parametrize("library", SYSTEM_LIBRARIES, ids=lambda library: library.file)
def test_one_of_them_is_enough_to_stop(library):
    with pytest.raises(LibraryMissing, match=library.file.replace(".", r"\.")) as caught:
        load(library.module, lambda file: file != library.file)
    assert f"apt install {library.package} " in caught.value.hint


@linux_only
def test_only_what_cannot_be_loaded_is_missing():
    assert missing_libraries(lambda _: True) == []
    assert missing_libraries(lambda file: file == "libGL.so.1") == [SYSTEM_LIBRARIES[0], SYSTEM_LIBRARIES[2]]


def test_the_linker_is_asked():
    assert not loadable("libplanish-has-no-such.so.1")


def test_a_module_that_is_not_installed_is_named_with_the_command_that_installs_it():
    with pytest.raises(LibraryMissing, match="no_such_module_of_planish cannot be loaded") as caught:
        load("no_such_module_of_planish", lambda _: True)
    assert "pip install --force-reinstall no_such_module_of_planish" in caught.value.hint


def test_a_module_whose_own_library_is_missing_is_named(tmp_path, monkeypatch):
    (tmp_path / "broken_wheel_of_planish.py").write_text("raise ImportError('libfoo.so.2: cannot open\\nmore')\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(LibraryMissing, match=r"cannot be loaded: libfoo\.so\.2: cannot open$"):
        load("broken_wheel_of_planish", lambda _: True)


def test_imports_and_readers_need_none_of_them(repository, tmp_path):
    command = [sys.executable, "-c", WITHOUT_THEM, str(tmp_path / "page.obj")]
    done = subprocess.run(command, cwd=repository, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
