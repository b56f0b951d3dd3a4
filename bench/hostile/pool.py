"""Worker processes that read one damaged file after the other, with limits on processor time and memory.

A worker is forked from a process that has imported and compiled everything: what is measured is the reader alone.
"""

from __future__ import annotations

import ctypes
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from random import Random
from typing import Any

from bench.hostile.readers import OUT, Reader
from bench.memory import PROCESS, RESET_PEAK, status_mb
from station.commands.compile import compile_kernels
from station.errors import explain
from station.storage.folder_lock import WORK

SECONDS_PER_MB = 10.0
MEMORY_RATIO, MEMORY_MB = 12.0, 200.0  # of the file, and on top of that; above the idle process
GUARD_MB = 6000.0  # of address space: protects the machine, not the verdict
WALL_S = 900.0  # a reader that waits for ever uses no processor time; on a busy machine the others take long, too
RENEW_MB = 50.0  # growth that a worker keeps: it is replaced, so that what it holds hides nothing of the next
DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG, man 2 prctl: a worker ends with the process that it works for
MB = 1e6


@dataclass(frozen=True)
class Verdict:
    """What came of one file: its size in MB, the exit code, processor seconds, growth in MB, files left behind.

    signal  that ended the process, 0 for none. fault  the exception behind exit code 1.
    """

    index: int
    reader: str
    size: float
    code: int = 0
    seconds: float = 0.0
    growth: float = 0.0
    left: tuple[str, ...] = ()
    signal: int = 0
    fault: str = ""

    @property
    def violations(self) -> list[str]:
        """Which of the bounds it broke."""
        found = {
            "exit 1": self.code == 1,
            "signal": self.signal not in (0, signal.SIGXCPU),
            "time": self.signal == signal.SIGXCPU or self.seconds > SECONDS_PER_MB * max(self.size, 1.0),
            "memory": self.growth > MEMORY_RATIO * self.size + MEMORY_MB,
            "files left": bool(self.left),
        }
        return [name for name, broken in found.items() if broken]


class Examples:
    """The damaged files of a seed, by number."""

    def __init__(self, readers: Sequence[Reader], seed: int, scratch: Path) -> None:
        self._readers, self._seed, self._scratch = readers, seed, scratch
        self._sound = []
        for k, reader in enumerate(readers):
            folder = scratch / f"sound-{k}"
            folder.mkdir()
            self._sound.append(reader.sound(folder))
            shutil.rmtree(folder)

    def read_sound(self) -> None:
        """Read every sound example: imports what is imported late, compiles, and shows that they are sound."""
        _in_child(compile_kernels)  # also those that no sound example needs
        for k, (reader, files) in enumerate(zip(self._readers, self._sound, strict=True)):
            folder = self._scratch / f"warm-{k}"
            path = _write(files, folder) / reader.file
            if reader.name.startswith("planish"):  # its libraries must not start threads before workers are forked
                _in_child(partial(reader.read, path))
            else:
                reader.read(path)
            shutil.rmtree(folder)

    def make(self, index: int) -> tuple[Reader, dict[str, bytes]]:
        """The reader and the files of one number."""
        rng = Random(f"{self._seed}:{index}")
        weights = [reader.weight for reader in self._readers]
        k = rng.choices(range(len(weights)), weights)[0]
        return self._readers[k], self._readers[k].damaged(self._sound[k], rng)

    def read(self, index: int, idle_mb: float, folder: Path) -> Verdict:
        """Read one damaged file in this process."""
        reader, files = self.make(index)
        size = max(map(len, files.values())) / MB
        _write(files, folder)
        (temporary := folder / "tmp").mkdir()
        tempfile.tempdir = str(temporary)
        _limit(SECONDS_PER_MB * max(size, 1.0))
        (PROCESS / "clear_refs").write_text(RESET_PEAK)
        start = _processor_seconds()
        code, fault = _outcome(reader, folder / reader.file)
        seconds, growth = _processor_seconds() - start, status_mb("VmHWM") - idle_mb
        left = tuple(sorted(_left(folder, set(files), code)))
        shutil.rmtree(folder)
        return Verdict(index, reader.name, size, code, seconds, growth, left, fault=fault)


def run(examples: Examples, numbers: Iterator[int], workers: int, scratch: Path) -> Iterator[Verdict]:
    """The verdicts on the files of these numbers, in the order in which they come."""
    context, running = get_context("fork"), dict[Connection, list[Any]]()

    def start() -> None:
        index = next(numbers, None)
        if index is None:
            return
        ours, theirs = context.Pipe()
        worker = context.Process(target=_work, args=(theirs, examples, scratch), daemon=True)
        worker.start()
        theirs.close()
        ours.send(index)
        running[ours] = [worker, index, time.monotonic() + WALL_S]

    for _ in range(workers):
        start()
    while running:
        ready = wait(list(running), timeout=1.0)
        for connection in list(running):
            worker, index, deadline = running[connection]
            if connection in ready:
                verdict = _receive(connection)
                if verdict is not None:
                    yield verdict
                    following = next(numbers, None) if verdict.growth < RENEW_MB else None
                    if following is not None:
                        connection.send(following)
                        running[connection][1:] = following, time.monotonic() + WALL_S
                        continue
            elif time.monotonic() > deadline:
                worker.kill()
            else:
                continue
            if connection in ready and verdict is not None:
                connection.send(None)
            connection.close()
            worker.join()
            if connection not in ready or verdict is None:
                reader, files = examples.make(index)
                code = worker.exitcode or 0  # positive where an exception ended the worker
                size = max(map(len, files.values())) / MB
                yield Verdict(index, reader.name, size, int(code > 0), signal=max(-code, 0), fault="the worker ended")
            del running[connection]
            start()


def _receive(connection: Connection) -> Verdict | None:
    """The verdict of a worker, None when it has died."""
    try:
        verdict: Verdict = connection.recv()
    except (EOFError, ConnectionError):
        return None
    return verdict


def _work(connection: Connection, examples: Examples, scratch: Path) -> None:
    """Read the files whose numbers come, until None does; nothing is printed."""
    ctypes.CDLL(None).prctl(DEATH_SIGNAL, signal.SIGKILL)
    _silence()
    space = int((status_mb("VmSize") + GUARD_MB) * 2**20)
    resource.setrlimit(resource.RLIMIT_AS, (space, space))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    idle = status_mb("VmRSS")
    while (index := connection.recv()) is not None:
        connection.send(examples.read(index, idle, scratch / str(index)))


def _silence() -> None:
    """Connect standard input and output of this process to nothing."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(nothing, descriptor)
    sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: SIM115, PTH123 - as long as the process


def _in_child(work: Callable[[], object]) -> None:
    """Run a function in a process of its own, silently."""

    def run() -> None:
        _silence()
        work()

    child = get_context("fork").Process(target=run)
    child.start()
    child.join()


def _outcome(reader: Reader, path: Path) -> tuple[int, str]:
    """The exit code of reading a file, and the exception where it is 1."""
    try:
        code = reader.read(path)
    except BaseException as error:
        code = explain(error).exit_code
        return code, f"{type(error).__name__}: {str(error)[:200]}" if code == 1 else ""
    code = code if isinstance(code, int) and reader.name.startswith("planish") else 0
    return code, "run the command with --debug" if code == 1 else ""


def _write(files: dict[str, bytes], folder: Path) -> Path:
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    return folder


def _left(folder: Path, files: set[str], code: int) -> Iterator[str]:
    """Files that are left behind: temporary ones, and of a command that failed its results."""
    for path in folder.rglob("*"):
        name = str(path.relative_to(folder))
        result = code == 0 and name.startswith(f"{OUT}/") and WORK not in name
        if path.is_file() and name not in files and not result:
            yield name


def _processor_seconds() -> float:
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def _limit(seconds: float) -> None:
    """End this process by SIGXCPU when it uses more processor time from now on."""
    used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(used + seconds) + 1, hard))
