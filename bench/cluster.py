"""`python -m bench.cluster [--pages 12]`: a batch on a Dask cluster of three workers.

On the loopback: one is killed while it restores, one is short of memory, one lacks the package. What must hold: every
good page is restored, the damaged one alone is set aside, the exit code is 7, and `--json` lists it.
"""

from __future__ import annotations

import argparse
import json
import secrets
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from bench.watch import make_page
from station.errors import SET_ASIDE

PAGES = 12
LIMIT_S = 1800.0
SMALL_MIB = 520  # enough to be asked, and too little for a page
# A worker as on a computer where Planish was never installed.
BARE = """
import sys
class Refused:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("station", "restore", "drivers"):
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Refused())
from distributed.cli.dask_worker import main
main()
"""


def main(pages: int = PAGES, seed: int | None = None) -> int:
    """Print what came of the batch. Returns 1 when it is not as it must be."""
    seed = secrets.randbits(20) if seed is None else seed
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder, out = Path(name) / "in", Path(name) / "out"
        folder.mkdir()
        good = [make_page(folder, seed + number).stem for number in range(pages)]
        (folder / "damaged.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 9\n")
        address = f"tcp://127.0.0.1:{_free_port()}"
        scheduler = "-m", "distributed.cli.dask_scheduler", "--host", address, "--no-dashboard", "--no-show"
        stack.enter_context(_process(*scheduler))
        killed = stack.enter_context(_worker(address, "killed"))
        stack.enter_context(_worker(address, "small", f"{SMALL_MIB}MiB"))
        stack.enter_context(_worker(address, "bare", code=BARE))
        facts, code, errors = _batch(folder, out, address, killed)
        restored = {path.stem for path in out.rglob("*.json") if path.parent.name == path.stem}
    aside = [one["name"] for one in facts.get("set_aside", [])]
    missing = sorted(set(good) - restored)
    print(f"{pages} good pages, seed {seed}: {len(good) - len(missing)} restored, set aside {aside}, exit code {code}")
    for line in errors:
        print(f"  {line}")
    print(f"{time.perf_counter() - start:.0f} s")
    return int(bool(missing) or aside != ["damaged.ply"] or code != SET_ASIDE)


def _batch(
    folder: Path, out: Path, address: str, killed: subprocess.Popen[bytes]
) -> tuple[dict[str, Any], int, list[str]]:
    """The last line of `planish batch --json`, its exit code and its messages.

    A worker is killed after the first page. Another with as much memory takes its place.
    """
    arguments = [
        "batch",
        str(folder),
        "-o",
        str(out),
        "--scheduler",
        address,
        "--points",
        "100",
        "--dpi",
        "40",
        "--json",
    ]
    command = [
        sys.executable,
        "-c",
        "import sys; from station.cli import main; sys.exit(main(sys.argv[1:]))",
        *arguments,
    ]
    said = out.parent / "said.txt"
    last = "{}"
    with said.open("wb") as errors, ExitStack() as later:
        run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)
        assert run.stdout is not None
        for number, line in enumerate(run.stdout):
            print(f"  {line.rstrip()[:150]}", flush=True)
            last = line
            if number == 0:
                killed.send_signal(signal.SIGKILL)
                later.enter_context(_worker(address, "late"))
        code = run.wait(LIMIT_S)
    return json.loads(last), code, said.read_text().splitlines()


@contextmanager
def _process(*arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process of Python until the block ends."""
    quiet = subprocess.DEVNULL
    started = subprocess.Popen([sys.executable, *arguments], stdout=quiet, stderr=quiet)
    try:
        yield started
    finally:
        started.terminate()
        started.wait()


@contextmanager
def _worker(address: str, name: str, memory: str = "4GiB", *, code: str = "") -> Iterator[subprocess.Popen[bytes]]:
    """A worker of one thread, by a code of its own or by that of Dask."""
    start = ("-c", code) if code else ("-m", "distributed.cli.dask_worker")
    options = "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny", "--no-dashboard", "--memory-limit", memory
    with (
        tempfile.TemporaryDirectory() as own,
        _process(*start, address, "--name", name, *options, "--local-directory", own) as started,
    ):
        yield started


def _free_port() -> int:
    with socket.socket() as asked:
        asked.bind(("127.0.0.1", 0))
        return int(asked.getsockname()[1])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pages", type=int, default=PAGES)
    parser.add_argument("--seed", type=int, help="of an earlier run; a fresh one by default")
    options = parser.parse_args()
    sys.exit(main(options.pages, options.seed))
