"""Wheel and sdist: complete, acceptable to an index, and usable in an empty folder."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MAX_WHEEL_MB = 6.0  # 1.2 without what the web interface takes from npm; a data set or a build folder would exceed it
ENTRY = "import sys; from station.__main__ import main; sys.argv = ['planish', *sys.argv[1:]]; sys.exit(main())"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (find_spec("build") and find_spec("twine")), reason="build and twine are not installed"),
]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel and the sdist that it was built from, out of a copy of the sources."""
    folder = tmp_path_factory.mktemp("distribution")
    subprocess.run(["git", "clone", "-q", ROOT, folder / "sources"], check=True)
    command = [sys.executable, "-m", "build", "--no-isolation", "-o", folder / "dist", folder / "sources"]
    subprocess.run(command, check=True, capture_output=True)
    return folder / "dist"


def test_an_index_accepts_both(built: Path) -> None:
    files = sorted(built.iterdir())
    assert [file.suffix for file in files] == [".whl", ".gz"]
    subprocess.run([sys.executable, "-m", "twine", "check", "--strict", *files], check=True, capture_output=True)


def test_the_wheel_has_its_data_and_no_more(built: Path) -> None:
    (wheel,) = built.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert wheel.stat().st_size < MAX_WHEEL_MB * 1e6
    assert {"drivers/configs/simulated.toml", "restore/py.typed", "station/console/page/strings.json"} <= set(names)
    assert {name.split("/")[0].partition("-")[0] for name in names} == {"drivers", "restore", "station", "planish"}


def test_the_wheel_works_in_an_empty_folder(built: Path, tmp_path: Path) -> None:
    """With the libraries of this environment, and the packages, configurations and profiles of the wheel."""
    (wheel,) = built.glob("*.whl")
    installed, work = tmp_path / "installed", tmp_path / "work"
    zipfile.ZipFile(wheel).extractall(installed)
    work.mkdir()
    for arguments in (["--version"], ["query", "--config", "simulated"], ["card", "-o", "card.pdf"]):
        run = [sys.executable, "-c", ENTRY, *arguments]
        environment = os.environ | {"PYTHONPATH": str(installed)}
        subprocess.run(run, check=True, cwd=work, capture_output=True, env=environment)
    assert (work / "card.pdf").read_bytes().startswith(b"%PDF")
    where = [sys.executable, "-c", "import station; print(station.__file__)"]
    printed = subprocess.run(where, check=True, cwd=work, capture_output=True, text=True, env=environment)
    assert Path(printed.stdout.strip()).is_relative_to(installed)
