"""The runs that are interrupted: commands of Planish whose computing is done once, and whose files are all written.

What reads the page, flattens it and encodes the results touches no file; it is done beforehand, by the same code. A run
then takes milliseconds: it parses its options, reads the scan, checks the folder, writes, flushes and moves its files.
"""

from __future__ import annotations

import os
import pickle
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import drivers
from bench.kill.events import in_child
from restore import RangeScan, load_scan, save_scan
from station.cli import main as planish
from station.page_files import outputs
from station.run import one_page
from station.run.small_page import small_page
from station.words.words import ProgramMissing, find_tesseract

EVERYTHING = ("--tiff", "--map", "--mesh", "--strain", "--frames", "--review", "--coverage", "--shading", "remove")
COARSE = ("--points", "300", "--dpi", "60")
SCAN, OUT, NOTES = "page.scan", "out", "notes.txt"

Tree = dict[str, bytes]


@dataclass(frozen=True)
class Run:
    """A command that is interrupted, in a folder that holds the scan, the configuration and earlier results.

    words   of the command. again  those of the next start, which must not replace anything.
    before  files of the folder of results.
    """

    name: str
    words: tuple[str, ...]
    again: tuple[str, ...]
    before: Tree


@dataclass(frozen=True, eq=False)
class Material:
    """What is made once: the earlier results and the new ones, the earlier scan and the new one, the page."""

    old: Tree
    new: Tree
    old_scan: Tree
    new_scan: RangeScan
    page: Any


def prepare(scratch: Path) -> Material:
    """Restore two scans with every option, in processes of their own: their threads would not outlive a fork."""
    first = small_page()
    assert first.texture is not None
    second = replace(first, texture=255 - first.texture)
    options = (*EVERYTHING, *COARSE, *(("--ocr",) if _reads_words() else ()))
    for name, scan in (("old", first), ("new", second)):
        save_scan(scan, scratch / name / SCAN)
        words = ("restore", str(scratch / name / SCAN), "-o", str(scratch / name / OUT), *options)
        if code := in_child(lambda words=words, name=name: _restore(words, scratch / name / "page.pickle"), 600.0):
            sys.exit(f"planish {' '.join(words)} ended with {code}")
    page = pickle.loads((scratch / "new" / "page.pickle").read_bytes())
    loaded = load_scan(scratch / "new" / SCAN)
    assert isinstance(loaded, RangeScan)
    trees = tree(scratch / "old" / OUT), tree(scratch / "new" / OUT), tree(scratch / "old" / SCAN)
    return Material(*trees, loaded, page)


def runs(material: Material) -> list[Run]:
    """Restorations and scans, into a folder with earlier results and into a new one, with all options and with few."""
    options = (*EVERYTHING, *COARSE, *(("--ocr",) if _reads_words() else ()))
    restore, scan = ("restore", SCAN, "-o", OUT), ("scan", "--config", "station.toml", "-o", OUT)
    stored = {f"{SCAN}/{name}": data for name, data in material.old_scan.items()}
    earlier = {**material.old, NOTES: b"mine"}
    return [
        Run("restore --force, every option", (*restore, "--force", *options), (*restore, *options), earlier),
        Run("restore --force, no option", (*restore, "--force"), restore, earlier),
        Run("restore, new folder", (*restore, *options), (*restore, *options), {}),
        Run("scan --force", (*scan, "--force"), scan, {**earlier, **stored}),
        Run("scan, new folder", scan, scan, {}),
    ]


def place(run: Run, material: Material, folder: Path) -> None:
    """Make the folder of a run anew."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    save_scan(material.new_scan, folder / SCAN)
    (folder / "station.toml").write_text('[scanner]\ndriver = "simulated"\n')
    for name, data in run.before.items():
        (folder / OUT / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / OUT / name).write_bytes(data)


def tree(folder: Path) -> Tree:
    """The files below a folder, with their contents; empty folders do not count."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@contextmanager
def computed(material: Material) -> Iterator[None]:
    """While the block runs, pages and the bytes of results come from the material."""

    def encode(done: outputs.Restoration, kinds: frozenset[str]) -> Iterator[bytes]:
        return (material.new[name] for name in outputs.names(done.stem, kinds, done.page))

    def restored(*_: Any, on_step: Any = None, **__: Any) -> Any:
        if on_step:
            on_step(1, material.page.flat.vertices, material.page.flat.faces)
        return material.page

    replaced = {
        (one_page, "restore"): restored,
        (one_page, "recognise"): lambda *_, **__: None,
        (one_page, "check_language"): lambda *_, **__: None,  # asks the program that reads words
        (outputs, "encode_outputs"): encode,
        (drivers, "open_scanner"): lambda _config: _Scanner(material.new_scan),
    }
    before = {place: getattr(*place) for place in replaced}
    for (module, name), value in replaced.items():
        setattr(module, name, value)
    try:
        yield
    finally:
        for (module, name), value in before.items():
            setattr(module, name, value)


def command(words: Sequence[str], folder: Path) -> int:
    """The exit code of a command that runs in a folder."""
    os.chdir(folder)
    return planish(words)


class _Scanner:
    """A scanner that has captured already."""

    def __init__(self, scan: RangeScan) -> None:
        self._scan = scan

    def __enter__(self) -> _Scanner:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def capture(self, *_: object) -> RangeScan:
        return self._scan


def _restore(words: Sequence[str], pickled: Path) -> int:
    """Run a restoration, and keep its page."""
    restore = one_page.restore

    def keeping(*arguments: Any, **options: Any) -> Any:
        page = restore(*arguments, **options)
        pickled.write_bytes(pickle.dumps(page))
        return page

    one_page.restore = keeping
    return planish(words)


def _reads_words() -> bool:
    try:
        find_tesseract()
    except ProgramMissing:
        return False
    return True
