"""A scanner that is a script of a few lines."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivers import open_scanner

MESH = "v 0 0 0\nv 100 0 0\nv 100 80 0\nv 0 80 0\nf 1 2 3\nf 1 3 4\n"
WRITES = f"import sys, pathlib; pathlib.Path(sys.argv[1]).write_text({MESH!r})"


@pytest.fixture
def table(tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """The table of a scanner that is a script; further keys of it."""

    def make(script: str = WRITES, *words: str, **keys: Any) -> dict[str, Any]:
        path = tmp_path / "grab.py"
        path.write_text(script)
        command = ["{python}", str(path), "{output}", *words]
        return {"driver": "program", "capture": command, "output": "shot.obj", "settle_s": 0, "timeout_s": 60, **keys}

    return make


@pytest.fixture
def opened(table, monkeypatch, tmp_path_factory) -> Callable[..., Any]:
    """The scanner of such a table; its shots lie in a folder of their own."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path_factory.mktemp("shots")))
    return lambda *words, **keys: open_scanner(table(*words, **keys))
