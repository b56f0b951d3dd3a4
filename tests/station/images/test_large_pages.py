"""The memory that a page of many pixels takes while its files are written."""

from __future__ import annotations

import subprocess
import sys

import pytest

# Of a page four times as large: tables of its strips, and what the allocator keeps. Its picture has 170 MB more.
MORE_MB = 40.0
PAGE = """
import io, sys
import numpy as np
from restore import Settings, SurfaceMesh, restore
from station.images.png import write_png
from station.images.tiff import write_tiff

dpi = float(sys.argv[1])
corners = np.array([[0.0, 0.0, 0.0], [220.0, 0.0, 0.0], [220.0, 150.0, 0.0], [0.0, 150.0, 0.0]])
texture = np.random.default_rng(1).integers(0, 256, (480, 640, 3), np.uint8)
pixels = np.array([[20.0, 460.0], [620.0, 460.0], [620.0, 20.0], [20.0, 20.0]])
page = restore(SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), pixels, texture), Settings(dpi=dpi))
with open("/dev/null", "wb") as file:
    write_png(page.by_rows("image"), dpi, None, file)
with open(sys.argv[2], "w+b") as file:
    write_tiff(page.by_rows("image"), dpi, None, file)
print(page.by_rows("image").shape[0] * page.by_rows("image").shape[1])
with open("/proc/self/status") as status:
    print(next(line.split()[1] for line in status if line.startswith("VmHWM")))
"""


def pixels_and_memory_mb(dpi: float, folder) -> tuple[int, float]:
    command = [sys.executable, "-c", PAGE, str(dpi), str(folder / "page.tif")]
    pixels, kilobytes = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    return int(pixels), int(kilobytes) / 1024


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the memory of a process is read from /proc")
def test_a_page_of_four_times_the_pixels_takes_no_more_memory(tmp_path):
    (small, of_small), (large, of_large) = (pixels_and_memory_mb(dpi, tmp_path) for dpi in (600.0, 1200.0))
    assert large > 3.9 * small
    assert of_large < of_small + MORE_MB
