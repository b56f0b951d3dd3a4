"""README and tutorials are followed word by word in an empty folder: each command that they show runs there."""

from __future__ import annotations

import io
import re
import shlex
import subprocess
import sys
from multiprocessing import resource_tracker
from pathlib import Path

import numpy as np
import pytest

from restore import SurfaceMesh
from restore.formats import write_obj
from station.cli import main
from station.session import read_session

# The process that Python keeps next to spawned ones for as long as it runs: it is no leak of the first test.
resource_tracker.ensure_running()

ROOT = Path(__file__).parents[1]
README, FIRST_PAGE, FIRST_VOLUME = (
    ROOT / name for name in ("README.md", "docs/tutorials/first-page.md", "docs/tutorials/first-volume.md")
)
BLOCK = re.compile(r"^```(?:[a-z]*)\n(.*?)^```|^((?: {4}\S.*\n)+)", re.DOTALL | re.MULTILINE)
COMMAND = re.compile(r"^ *((?:make|planish|python3?|sudo) .*?)(?: {3,}.*)?$", re.MULTILINE)
# What of them needs more than an empty folder, and the test that runs it.
ELSEWHERE = {
    "make test": "Makefile",  # this test is a part of it
    "sudo apt install libegl1 libgl1 libopengl0 tesseract-ocr": "tests/restore/runtime/test_native.py",
    "python3 -m venv planish && planish/bin/pip install PATH-OF-THE-SOURCES": "tests/test_distribution.py",
    "planish photos *.jpg -o OUT": "tests/station/run/test_photos.py",
}


def shown(document: Path) -> list[str]:
    """Commands in the blocks of a document, from top to bottom, without what a table says of them."""
    blocks = (fenced or indented for fenced, indented in BLOCK.findall(document.read_text("utf-8")))
    return [line for block in blocks for line in COMMAND.findall(block)]


def recipe(target: str) -> str:
    """The one command of a target of the Makefile, with files of the sources by their whole path."""
    (line,) = re.findall(rf"^{target}:.*\n\t\$\(BIN\)/(planish .*)\n", (ROOT / "Makefile").read_text("utf-8"), re.M)
    return line.replace("configs/", f"{ROOT}/configs/")


def follow(line: str) -> None:
    """Run a command as it is shown."""
    words = shlex.split(recipe(line.removeprefix("make ")) if line.startswith("make ") else line)
    assert words[0] == "planish"
    assert main(words[1:]) == 0, line


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder, with an index of sessions of its own."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


def test_the_commands_of_a_document_are_found():
    assert shown(FIRST_PAGE)[0] == "make demo"
    assert "planish restore book.obj -o OUT" in shown(README)
    assert [line.split()[1] for line in shown(FIRST_VOLUME)] == ["session", "capture", "session", "verify", "export"]


def test_what_is_run_elsewhere_is_shown_and_exists():
    lines = [line for document in (README, FIRST_PAGE, FIRST_VOLUME) for line in shown(document)]
    assert set(lines) >= ELSEWHERE.keys()
    assert all((ROOT / path).exists() for path in ELSEWHERE.values())


@pytest.mark.slow
def test_the_readme(folder):
    rows, cols = np.indices((11, 15)).reshape(2, -1) * 10.0
    first = np.arange(150).reshape(10, 15)[:, :-1].ravel()
    faces = np.concatenate([first[:, None] + [0, 1, 16], first[:, None] + [0, 16, 15]])
    write_obj(
        SurfaceMesh(np.stack([cols, 100.0 - rows, np.cos(cols / 40.0)], axis=1), faces[:, ::-1]), Path("book.obj")
    )
    for line in shown(README):
        if line not in ELSEWHERE:
            follow(line)
    for name in re.findall(r"\b(?:out/demo|OUT)/[\w-]+\.\w+", README.read_text("utf-8")):
        assert (folder / name).is_file(), name
    exec(re.findall(r"```python\n(.*?)```", README.read_text("utf-8"), re.DOTALL)[0], {})


@pytest.mark.slow
def test_the_first_page(folder):
    for line in shown(FIRST_PAGE):
        follow(line)
    assert (folder / "out/demo/page.png").is_file()
    assert (folder / "out/again/page-strain.png").is_file()
    assert (folder / "out/coverage/page-coverage.png").is_file()


NUMBER = re.compile(r"\d+(\.\d+)?")  # what is measured may change with the methods; the words are exact
KEYS = {"space": " ", "enter": "\n", "n": "nleaf torn\n"}  # as they are typed; any other is itself


@pytest.mark.slow
def test_the_first_volume(folder, monkeypatch, capsys):
    """Every key of the table is pressed once, in its order."""
    text = FIRST_VOLUME.read_text("utf-8")
    names = [name for row in re.findall(r"^\| ([^|]+) \|", text, re.M) for name in row.split(", ")][1:]
    keys = "".join(KEYS.get(name, name) for name in names if name != "---")
    assert keys == " \nruUmnleaf torn\n?q"
    for line in shown(FIRST_VOLUME):
        monkeypatch.setattr(sys, "stdin", io.StringIO(keys))
        follow(line)
    (page,) = read_session(folder / "missale").history.pages()
    assert page.runs.keys() >= {"restore"}
    assert [path.suffix for path in (folder / "missale-pdf").rglob("*.pdf")] == [".pdf"]
    printed = capsys.readouterr().out
    assert "page 1 [1]: stored" in printed and "page 1 [1]: accepted" in printed


@pytest.mark.slow
def test_the_screen_of_the_first_volume_is_what_the_bench_prints():
    text = FIRST_VOLUME.read_text("utf-8")
    lines = [line for block in re.findall(r"^```\n(.*?)^```", text, re.DOTALL | re.M) for line in block.splitlines()]
    done = subprocess.run([sys.executable, "-m", "bench.shift"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert len(lines) > 10
    assert {NUMBER.sub("#", line) for line in lines} <= {NUMBER.sub("#", line) for line in done.stdout.splitlines()}
