"""Peak memory is that of this program."""

from __future__ import annotations

import subprocess
import sys

import numpy as np

from station.peak_memory import peak_memory_mib

MIB = 2**20


def test_a_large_array_is_in_the_peak_after_it_is_gone():
    before = peak_memory_mib()
    block = np.ones(200 * MIB, np.uint8)
    del block
    assert peak_memory_mib() > before
    assert peak_memory_mib() > 200


def test_a_program_does_not_inherit_the_peak_of_the_one_that_started_it():
    block = np.ones(400 * MIB, np.uint8)
    code = "from station.peak_memory import peak_memory_mib; print(peak_memory_mib())"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert block.all()
    assert 1 < float(told) < 200
