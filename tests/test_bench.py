"""What `python -m bench` runs is there: a bench that fails on its first line measures nothing."""

from importlib import import_module
from pathlib import Path

import pytest

import bench

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
