"""Sessions of small scans, on a clock of their own."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from itertools import count
from pathlib import Path

import pytest

from oracles.tiny_scan import tiny_scan as make_tiny_scan
from restore import RangeScan
from station.session import Volume, create_session


def ticking() -> Callable[[], datetime]:
    """A clock on which a second passes every time somebody looks."""
    seconds = count()
    return lambda: datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC) + timedelta(seconds=next(seconds))


@pytest.fixture
def tiny_scan() -> RangeScan:
    """A scan to be stored, not to be restored."""
    return make_tiny_scan()


@pytest.fixture
def volume(tmp_path: Path) -> Path:
    """A session without pages."""
    folder = tmp_path / "volume"
    create_session(folder, Volume(title="A volume", project="tests"), now=ticking(), new_id=lambda: "an-id")
    return folder
