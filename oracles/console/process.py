"""A console that is served by a process of its own, to be killed and started again."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

END_S = 60.0


@dataclass
class Console:
    """A console and its folder of sessions.

    module     that serves it: `leaves`, whose scans are small, or `volume`, before the simulated scanner.
    processes  those that were started, the last one may be running.
    """

    folder: Path
    module: str = "leaves"
    processes: list[subprocess.Popen[str]] = field(default_factory=list)

    def start(self, *options: str) -> str:
        """Start it; returns its link."""
        command = [sys.executable, "-m", f"oracles.console.{self.module}", str(self.folder), *options]
        self.processes.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        assert self.processes[-1].stdout is not None
        return self.processes[-1].stdout.readline().strip()

    def kill(self, number: int = signal.SIGKILL) -> None:
        """End it by a signal."""
        self.processes[-1].send_signal(number)
        self.processes[-1].wait(END_S)

    def close(self) -> None:
        """End whatever is left."""
        for process in self.processes:
            if process.poll() is None:
                process.terminate()
                process.wait(END_S)
            assert process.stdout is not None
            process.stdout.close()


@contextmanager
def console_of(folder: Path, module: str = "leaves") -> Iterator[Console]:
    """A console that is ended with the block; it is not started yet."""
    console = Console(folder, module)
    try:
        yield console
    finally:
        console.close()
