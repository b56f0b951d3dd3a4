"""What `python -m bench` runs is there: a bench that fails on its first line measures nothing."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import bench

PIXELS = 100_000
FLAT_MM = 0.05  # a flat page in FAST mode is about half as far off
MODULES = sorted(path.stem for path in Path(bench.__file__).parent.glob("*.py") if not path.stem.startswith("__"))
# They come with the extra `bench` alone.
OPTIONAL = ("igl", "matplotlib", "skimage")


@pytest.mark.parametrize("name", MODULES)
def test_every_module_is_read_without_a_fault(name):
    try:
        import_module(f"bench.{name}")
    except ImportError as missing:
        if missing.name not in OPTIONAL:
            raise
        pytest.skip(f"{missing.name} is not installed")


def test_the_layout_of_a_page_is_compared_pixel_by_pixel():
    from bench.layout import layout_error
    from drivers.simulated import Flat, shoot
    from restore import Settings, restore

    scan, truth = shoot(Flat(), seed=1, mode="fast")
    page = restore(scan, Settings(dpi=100))
    error = np.linalg.norm(layout_error(page, scan, truth), axis=1)
    assert len(error) > PIXELS
    assert np.sqrt((error**2).mean()) < FLAT_MM
    shifted = replace(page, page_map=page.page_map + np.linspace(0, 4, page.page_map.shape[1])[None, :, None])
    assert np.sqrt((layout_error(shifted, scan, truth) ** 2).sum(axis=1).mean()) > 10 * FLAT_MM
