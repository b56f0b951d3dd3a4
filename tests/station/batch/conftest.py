"""Small scans that are restored in a fraction of a second."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.simulated.scene.sheets import Curl
from oracles.exact import exact_sheet
from restore import Settings, SurfaceMesh
from restore.formats import write_ply
from station.run.options import RunOptions
from station.workers import executors
from station.workers.process import Isolation

QUICK = RunOptions(Settings(points=100, dpi=40))
MESH_POINTS, TEXTURE = 150, (60, 80, 3)


def small_scan(path: Path, seed: int = 0) -> Path:
    """A painted curl as a binary PLY with its picture beside it."""
    mesh = exact_sheet(Curl(), MESH_POINTS, seed=seed).mesh
    low = mesh.vertices[:, :2].min(axis=0)
    share = (mesh.vertices[:, :2] - low) / (mesh.vertices[:, :2].max(axis=0) - low)
    texture = np.random.default_rng(seed).integers(0, 256, TEXTURE, np.uint8)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_ply(SurfaceMesh(mesh.vertices, mesh.faces, share * (TEXTURE[1] - 1, TEXTURE[0] - 1), texture), path)
    return path


class AtOnce:
    """In place of a pool of threads: what is submitted is done in this thread."""

    def __init__(self, *_: object, **__: object) -> None:
        pass

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(function(*arguments))
        return future

    def shutdown(self, **_: object) -> None:
        pass


@pytest.fixture
def in_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages are restored in this process: no other has to begin."""
    monkeypatch.setattr(Isolation, "run", lambda self, work, task: work(task, ()))
    monkeypatch.setattr(executors, "ThreadPoolExecutor", AtOnce)


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    """A folder with four small scans, one of them in a sub-folder, and a damaged one."""
    for number, name in enumerate(("a.ply", "b.ply", "sub/a.ply", "sub/c.ply")):
        small_scan(tmp_path / "scans" / name, number)
    (tmp_path / "scans/broken.ply").write_bytes(b"ply\nformat ascii 1.0\nend_header\n")
    return tmp_path / "scans"
