"""Sessions of small scans, on a clock of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from itertools import count
from pathlib import Path

import pytest

from oracles.tiny_scan import tiny_scan as make_tiny_scan
from restore import RangeScan
from station.session import Volume, Writer, add_scan, create_session, open_session
from station.session.terms.presets import load_preset
from tests.restore.layout.conftest import shot


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


@pytest.fixture
def opening(tmp_path: Path) -> Iterator[Writer]:
    """A session of one opening of a book, which is to become two coarse leaves."""
    values = load_preset("book").model_dump(mode="json", exclude_none=True)
    values |= {"layout": "auto", "settings": {"points": 300, "dpi": 50}}
    create_session(tmp_path / "book", Volume(title="A book", preset_values=values))
    with open_session(tmp_path / "book") as writer:
        add_scan(writer, shot(False)[0], facts={})
        yield writer
