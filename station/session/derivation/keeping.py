"""Restorations of one process, which keeps what it computed for the last page.

A page that is corrected by hand is flattened once: its rotation, crop and light follow from the flat page.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from restore.runtime import Store, keep_in
from station.session.derivation.restoration import Run, run_restore

_STORE = Store()


def restore_keeping(source: Path, parameters: Mapping[str, Any], folder: Path) -> Run:
    """Restore a stored scan, as `run_restore` does; the same files and the same result."""
    with keep_in(_STORE, source):
        return run_restore(source, parameters, folder)
