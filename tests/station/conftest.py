"""A small page whose truth is known, and stand-ins for the library and the scanner to fail on demand."""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer

from drivers import CaptureSettings
from restore import FlatMesh, Photograph, RangeScan, RestoredPage, Settings
from restore.mesh.network import make_network
from restore.mesh.topology import Topology
from restore.phones.load import Capture
from restore.scan import ScannedSheet
from station import cli
from station.commands import terminal
from station.commands.terminal import print_fault
from station.errors import Fault
from station.run import one_page
from tests.station.hints import missing_options

# The process that Python keeps next to spawned ones for as long as it runs: it is no leak of the first test.
resource_tracker.ensure_running()

COLS, ROWS = 24, 16
WIDTH_MM, HEIGHT_MM, RADIUS_MM = 120.0, 80.0, 60.0
DISTANCE_MM = 900.0
SMALL_FILE = 2000  # bytes: less than a scan or a page has, more than the lock of a folder
# Measures that every bundled preset calls green.
GOOD = {
    "measured_fraction": 0.99,
    "hole_mm": 1.0,
    "cropped_fraction": 0.0,
    "depth_window_fraction": 0.5,
    "smooth_strain_rms": 0.001,
    "sampling_ppi": 60.0,
    "blur_px": 0.8,
    "clipped_fraction": 0.0,
}
CHORDS = {"max_difference_at_mm": [0.0, 0.0]}


def curl_scan() -> RangeScan:
    """A page rolled round a vertical cylinder, seen from the front; sample (row, col) on texture pixel 4·(col, row)."""
    across, down = np.meshgrid(np.linspace(-0.5, 0.5, COLS) * WIDTH_MM, np.linspace(0.5, -0.5, ROWS) * HEIGHT_MM)
    angle = across / RADIUS_MM
    points = np.stack([RADIUS_MM * np.sin(angle), down, RADIUS_MM * np.cos(angle) - DISTANCE_MM], axis=2)
    texture_xy = np.stack(np.meshgrid(np.arange(COLS) * 4.0, np.arange(ROWS) * 4.0), axis=2)
    rng = np.random.default_rng(7)
    texture = rng.integers(0, 256, (ROWS * 4, COLS * 4, 3), np.uint8)
    return RangeScan(points, texture, texture_xy, {"device": "stand-in"})


def curl_mesh(scan: RangeScan) -> FlatMesh:
    """The scan as a mesh with its exact flat page."""
    index = np.arange(ROWS * COLS).reshape(ROWS, COLS)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, c, d), (a, d, b))])
    flat = np.stack(np.meshgrid(np.linspace(0, WIDTH_MM, COLS), np.linspace(HEIGHT_MM, 0, ROWS)), axis=2)
    texcoords = scan.texture_xy.reshape(-1, 2)
    vertices = scan.points.reshape(-1, 3)
    lengths = make_network(vertices, Topology(faces)).lengths
    return FlatMesh(vertices, faces, texcoords, scan.texture, {}, flat.reshape(-1, 2), 40, lengths)


@pytest.fixture
def scan() -> RangeScan:
    return curl_scan()


@pytest.fixture
def page(scan: RangeScan) -> RestoredPage:
    return restored(scan, Settings())


@pytest.fixture
def small_files() -> AbstractContextManager[None]:
    """A block in which the system refuses to write more than SMALL_FILE bytes to a file, as a full disk would."""

    @contextmanager
    def limited() -> Iterator[None]:
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (SMALL_FILE, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    return limited()


def restored(scan: RangeScan, settings: Settings) -> RestoredPage:
    """What the library would give for the scan, with the scan's texture as the page."""
    assert scan.texture is not None
    height, width = scan.texture.shape[:2]
    page_map = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=2).astype(np.float32)
    report = {
        "points": ROWS * COLS,
        "method": settings.method,
        "dpi": settings.dpi,
        "shading": settings.shading,
        "iterations": 40,
        "flipped_faces": 0,
        "area_ratio": 1.0,
        "strain": {"rms": 0.002, "smooth_rms": 0.001, "max": 0.012, "chord_strain": CHORDS},
        "page_mm": [WIDTH_MM, HEIGHT_MM],
        "resolved_ppi": 20.3,
        "coverage": {"measured": 1.0, "cut": 0.0},
        "seconds": dict.fromkeys(("prepare", "decimate", "flatten", "texture", "shade"), 0.5),
    }
    mask = np.ones((height, width), bool)
    mesh, coverage = curl_mesh(scan), mask.astype(np.uint8)
    page = RestoredPage({}, settings.dpi, mesh, mesh, report)
    return page.with_pictures(image=scan.texture, mask=mask, page_map=page_map, master=scan.texture, coverage=coverage)


@dataclass
class Library:
    """Stands in for load_scan, load_capture and restore.

    `fault` is raised by the restoration, `calls` has the settings that were asked for.
    """

    fault: BaseException | None = None
    load_fault: BaseException | None = None
    calls: list[Settings] = field(default_factory=list)
    photos: Sequence[Photograph] = ()

    def load_scan(self, path: Path, texture: Path | None = None, **reading: str) -> RangeScan:
        if self.load_fault:
            raise self.load_fault
        return curl_scan()

    def load_capture(self, path: Path, texture: Path | None = None, **reading: str) -> Capture:
        return Capture(self.load_scan(path, texture, **reading))

    def restore(
        self,
        scan: RangeScan | ScannedSheet,
        settings: Settings,
        *,
        photos: Sequence[Photograph] = (),
        progress: Callable[[str, float], None],
        on_step: Callable[..., None] | None,
        kept: object = None,
    ) -> RestoredPage:
        self.calls.append(settings)
        self.photos = photos
        progress("flatten", 0.5)
        if self.fault:
            raise self.fault
        page = restored(scan.scan if isinstance(scan, ScannedSheet) else scan, settings)
        for step in range(1, 41):
            if on_step:
                on_step(step, page.flat.vertices * (1, 1, 1 - step / 40), page.flat.faces)
        progress("flatten", 1.0)
        return page


@pytest.fixture(autouse=True)
def _hints_name_options_of_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fail a test in which a command tells a fault with an option that it does not have."""
    words: list[str] = []
    run = typer.Typer.__call__

    def remembered(program: typer.Typer, arguments: Sequence[str] | None = None, **options: Any) -> Any:
        words[:] = arguments or ()
        return run(program, arguments, **options)

    def checked(fault: Fault) -> None:
        for hint in fault.hints:
            assert missing_options(hint, words) == [], hint
        print_fault(fault)

    monkeypatch.setattr(typer.Typer, "__call__", remembered)
    for module in (cli, terminal):
        monkeypatch.setattr(module, "print_fault", checked)


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> Library:
    """The station with stand-ins in the library's place."""
    library = Library()
    for name in ("load_capture", "load_scan", "restore"):
        monkeypatch.setattr(one_page, name, getattr(library, name))
    return library


@dataclass
class StandInScanner:
    """Gives the curl, or `fault`; `closed` counts how often it was let go."""

    fault: BaseException | None = None
    closed: int = 0

    def capture(self, settings: CaptureSettings, progress: Callable[[str, float], None]) -> RangeScan:
        progress("scan", 1.0)
        if self.fault:
            raise self.fault
        return curl_scan()

    def close(self) -> None:
        self.closed += 1

    def __enter__(self) -> StandInScanner:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@pytest.fixture
def scanner(monkeypatch: pytest.MonkeyPatch) -> StandInScanner:
    """The scanner that every configuration opens."""
    scanner = StandInScanner()
    monkeypatch.setattr(one_page.drivers, "open_scanner", lambda _config: scanner)
    return scanner


def fault(captured: str) -> list[str]:
    """The lines of a fault as it is told: what is wrong, then what to do now. No traceback, nothing else."""
    first, *hints = captured.splitlines()
    assert first.startswith("planish: ")
    assert all(hint.startswith("  ") for hint in hints)
    return [first.removeprefix("planish: "), *(hint.strip() for hint in hints)]


@pytest.fixture
def scan_file(tmp_path: Path) -> Path:
    """A scan to restore, for the stand-in library: its contents are never read."""
    path = tmp_path / "scans" / "book.abs.gz"
    path.parent.mkdir()
    path.write_bytes(b"original")
    return path


@pytest.fixture
def config_file(tmp_path: Path) -> Path:
    path = tmp_path / "station.toml"
    path.write_text('[scanner]\ndriver = "simulated"\n')
    return path
