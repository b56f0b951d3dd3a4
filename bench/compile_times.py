"""What the first run on a machine compiles: how many functions, and the processor seconds that each takes.

    python -m bench.compile_times [FOLDER]     the sources of another commit, instead of these

A process of its own, on a copy of the sources without anything compiled and with an empty NUMBA_CACHE_DIR, restores a
small page with the default settings; then `planish scan --config configs/simulated.toml` runs, and what that compiles
beyond is counted. The seconds of a function are its own, without those of the functions that it calls; a function
counts once for each signature. Those of numba itself, which array expressions bring along, are among them. Compare
folders in runs after each other: machines differ.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from restore import save_scan
from station.run.small_page import small_page

REPOSITORY = Path(__file__).parent.parent
NEEDED = ("configs", "drivers", "restore", "station")
MIN_S = 0.2  # of a function that is listed
# What the process runs, with nothing but what every commit has; its operands are the page, the output and the report.
RUN = """
import json, sys, threading, time
from numba.core import event

page, output, report = sys.argv[1:]
compiled, running = [], threading.local()

class Listener(event.Listener):
    def on_start(self, started):
        function = started.data["dispatcher"].py_func
        running.stack = [*getattr(running, "stack", []), [function.__module__, function.__qualname__, 0.0]]
        running.stack[-1].append(time.thread_time())

    def on_end(self, ended):
        module, name, of_callees, start = running.stack.pop()
        taken = time.thread_time() - start
        compiled.append([module, name, taken - of_callees])
        if running.stack:
            running.stack[-1][2] += taken

with event.install_listener("numba:compile", Listener()):
    from restore import load_scan, restore
    restore(load_scan(page))
    first = len(compiled)
    from station.cli import main
    code = main(["scan", "--config", "configs/simulated.toml", "-o", output])
with open(report, "w") as file:
    json.dump([compiled[:first], compiled[first:]], file)
sys.exit(code)
"""


class Compiled(NamedTuple):
    """A function that was compiled, for one signature, and the processor seconds that this took."""

    module: str
    name: str
    seconds: float


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the totals, the functions over MIN_S and the modules, those that take longest first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=REPOSITORY)
    page, scan = compiled_in(parser.parse_args(arguments).folder)
    print(f"{'':<24}{'functions':>10}{'processor s':>13}")
    for title, functions in (("a page", page), ("a scan, beyond it", scan), ("both", page + scan)):
        print(f"{title:<24}{len(functions):>10}{sum(one.seconds for one in functions):>13.1f}")
    print(f"\nfunctions over {MIN_S} s")
    for module, name, seconds in sorted(page + scan, key=lambda one: -one.seconds):
        if seconds > MIN_S:
            print(f"{seconds:7.2f}  {module}.{name}")
    print("\nmodules")
    for module, seconds, count in by_module(page + scan):
        print(f"{seconds:7.2f}  {module} ({count})")


def compiled_in(sources: Path) -> tuple[list[Compiled], list[Compiled]]:
    """What the sources in a folder compile for a page, and beyond that for a scan."""
    with tempfile.TemporaryDirectory(prefix="planish-compile-times-") as name:
        folder, copy = Path(name), Path(name, "sources")
        for needed in NEEDED:
            shutil.copytree(sources / needed, copy / needed, ignore=shutil.ignore_patterns("__pycache__"))
        save_scan(small_page(), folder / "page.scan")
        environment = os.environ | {"PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(folder / "kernels")}
        files = [str(folder / file) for file in ("page.scan", "output", "report.json")]
        command = [sys.executable, "-P", "-c", RUN, *files]
        subprocess.run(command, cwd=copy, env=environment, check=True, stdout=subprocess.DEVNULL)
        page, scan = json.loads((folder / "report.json").read_text())
    return [Compiled(*function) for function in page], [Compiled(*function) for function in scan]


def by_module(functions: Sequence[Compiled]) -> list[tuple[str, float, int]]:
    """Modules with the seconds and the number of their functions, those that take longest first."""
    seconds: Counter[str] = Counter()
    for function in functions:
        seconds[function.module] += function.seconds
    counts = Counter(function.module for function in functions)
    return sorted(((module, taken, counts[module]) for module, taken in seconds.items()), key=lambda row: -row[1])


if __name__ == "__main__":
    main()
