"""What a newcomer waits for: `make demo` from nothing, and the start of the program. For one commit or several.

    python -m bench.set_up [COMMIT …]     commits of this repository, one after the other (HEAD)

Each is cloned into a temporary folder, and the caches of pip and uv are empty. Wall and processor seconds are those of
the whole process tree. Compare the commits of one run only: machines differ, and their load changes.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

REPOSITORY = Path(__file__).parent.parent
REPEATS = 5
HEADINGS = ("commit", "make demo s", "processor s", ".venv MB", "import s", "import all s", "restore s", "beside s")
ROW = "{:<10}" + "{:>13}" * (len(HEADINGS) - 1)
DOOR = "from restore import Settings, load_scan, restore"


class Spent(NamedTuple):
    """Seconds of a command and of all processes that it started."""

    wall: float
    processor: float


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line for every commit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commits", nargs="*", default=["HEAD"])
    print(ROW.format(*HEADINGS))
    for commit in parser.parse_args(arguments).commits:
        with tempfile.TemporaryDirectory(prefix="planish-set-up-") as folder:
            print(ROW.format(commit[:9], *figures(commit, Path(folder))), flush=True)


def figures(commit: str, folder: Path) -> list[str]:
    """The figures of a commit, measured in an empty folder."""
    clone = folder / "planish"
    subprocess.run(["git", "clone", "--quiet", REPOSITORY, clone], check=True)
    subprocess.run(["git", "-C", clone, "checkout", "--quiet", commit], check=True)
    caches = {name: str(folder / name) for name in ("PIP_CACHE_DIR", "UV_CACHE_DIR")}
    demo = spent(["make", "demo"], clone, os.environ | caches)
    size = int(subprocess.run(["du", "-sm", clone / ".venv"], capture_output=True, check=True).stdout.split()[0])
    python, planish = clone / ".venv/bin/python", clone / ".venv/bin/planish"
    imports = [
        statistics.median(spent([python, "-c", statement], clone).wall for _ in range(REPEATS))
        for statement in ("import restore", DOOR)
    ]
    wall, beside = restored(planish, clone)
    values = (demo.wall, demo.processor, size, *imports, wall, beside)
    return [f"{value:.2f}" if value < 10 else f"{value:.0f}" for value in values]


def restored(planish: Path, clone: Path) -> tuple[float, float]:
    """Median seconds of `planish restore` of the demo's scan, and of those what its stages do not account for."""
    runs = []
    for _ in range(REPEATS + 1):
        out = clone / "out/again"
        shutil.rmtree(out, ignore_errors=True)
        wall = spent([planish, "restore", clone / "out/demo/page.scan", "-o", out], clone).wall
        runs.append((wall, wall - in_stages(json.loads((out / "page.json").read_text())["seconds"])))
    walls, rests = zip(*runs[1:], strict=True)  # the first run warms up
    return statistics.median(walls), statistics.median(rests)


def in_stages(seconds: Mapping[str, float]) -> float:
    """The sum of the stages of a report."""
    return sum(value for stage, value in seconds.items() if stage != "total")


def spent(command: Sequence[str | Path], folder: Path, environment: Mapping[str, str] | None = None) -> Spent:
    """The seconds of a command that runs in a folder. Raises CalledProcessError when it fails."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return Spent(wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


if __name__ == "__main__":
    main()
