"""Peak memory is that of this program."""

from __future__ import annotations

import subprocess
import sys

import numpy as np

MIB = 2**20


def reported(code: str) -> float:
    """What a program of its own prints."""
    return float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)


def test_a_large_array_is_in_the_peak_after_it_is_gone():
    code = f"""
import numpy as np
from station.run.peak_memory import peak_memory_mib
np.ones(200 * {MIB}, np.uint8).sum()
print(peak_memory_mib())
"""
    assert 200 < reported(code) < 400


def test_a_program_does_not_inherit_the_peak_of_the_one_that_started_it():
    block = np.ones(400 * MIB, np.uint8)
    assert 1 < reported("from station.run.peak_memory import peak_memory_mib; print(peak_memory_mib())") < 200
    assert block.all()
