"""Ctrl-C prints its two lines however early it comes: before the command is loaded, and before it begins to work."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from station import interrupt

LINES = "planish: stopped by Ctrl-C\n  run the same command again to start over\n"
# Ctrl-C as the module of this name is looked for.
PROGRAM = """
import importlib.abc, signal, sys

class Interrupt(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == MODULE:
            signal.raise_signal(signal.SIGINT)

MODULE = sys.argv.pop(1)
sys.meta_path.insert(0, Interrupt())
from station.__main__ import main
sys.exit(main())
"""


@pytest.mark.parametrize("module", ["station.cli", "numpy", "station.commands.trace", "station.run.one_page"])
def test_ctrl_c_while_modules_are_imported(module: str) -> None:
    words = [sys.executable, "-c", PROGRAM, module, "demo", "-o", "out"]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", LINES)


def test_a_process_that_ignores_ctrl_c_goes_on_ignoring_it() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        interrupt.end_on_ctrl_c()
        interrupt.raise_on_ctrl_c()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
