"""A scratch folder for what flushes thousands of files."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MEMORY = Path("/dev/shm")  # a folder in memory: a disk takes seconds for the flushes of one point


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """A folder that is removed when the block ends: in memory where the system has such a place."""
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as name:
        yield Path(name).resolve()
