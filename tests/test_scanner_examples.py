"""The example programs for scanners, each before a stand-in for its maker's package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivers import open_scanner, settings_of
from drivers.scanner import DeviceError
from restore import RangeScan
from station.run.shots import read_shot

EXAMPLES = Path(__file__).parents[1] / "examples" / "scanners"
TILT_MM, DEPTH_MM, STEP_MM = 20.0, 600.0, 1.0

# What each stand-in sees: a tilted plane whose upper left corner is missing, red to the left.
SCENE = f"""
import numpy as np
from contextlib import contextmanager
from types import SimpleNamespace as Some
rows, cols = np.mgrid[:60, :80]
z = {DEPTH_MM} + {TILT_MM} * rows / 60
xyz = np.dstack([(cols - 40) * z / {DEPTH_MM}, (rows - 30) * z / {DEPTH_MM}, z]) * {STEP_MM}
seen = (rows > 4) | (cols > 4)
rgb = np.zeros((60, 80, 3), np.uint8)
rgb[:, :40, 0] = 200
class Any:
    "Has every attribute, and does nothing."
    def __getattr__(self, name): return self.__dict__.setdefault(name, Any())
    def __call__(self, *a, **k): return self
    def __enter__(self): return self
    def __exit__(self, *a): pass
"""
FAKES = {
    "realsense": (
        "pyrealsense2",
        """
metres = np.where(seen[..., None], xyz, 0).astype(np.float32) / 1000
vertices = np.ascontiguousarray(metres).view([("x", "<f4"), ("y", "<f4"), ("z", "<f4")])
colour = Some(get_height=lambda: 60, get_width=lambda: 80, get_data=lambda: rgb)
frames = Some(get_color_frame=lambda: colour, get_depth_frame=lambda: "depth")
stream, format, camera_info, config = Any(), Any(), Some(name="name", serial_number="serial"), Any
class pipeline:
    running = False
    def start(self, config): self.running = True
    def wait_for_frames(self):
        assert self.running
        return "frames"
    def stop(self): self.running = False
def align(to): return Some(process=lambda got: frames)
class pointcloud:
    def calculate(self, depth): return Some(get_vertices=lambda: vertices)
def context():
    device = Some(get_info=lambda which: {"name": "D435", "serial": "77"}[which])
    return Some(query_devices=lambda: [device] * CAMERAS)
""",
        ["2"],
        "D435 77",
    ),
    "zivid_camera": (
        "zivid",
        """
class Settings:
    def __init__(self, acquisitions, color): assert acquisitions and color
    class Acquisition: pass
class Settings2D(Settings):
    def __init__(self, acquisitions): assert acquisitions
data = {"xyz": np.where(seen[..., None], xyz, np.nan).astype(np.float32), "rgba": np.dstack([rgb, rgb[..., :1] * 0])}
class Frame(Any):
    def point_cloud(self): return Some(copy_data=data.__getitem__)
class Camera(Any):
    def capture_2d_3d(self, settings): return Frame()
class Application(Any):
    def connect_camera(self): return Camera()
    def cameras(self): return [Some(info=Some(model_name="Zivid 2+ MR60", serial_number="77"))] * CAMERAS
""",
        [],
        "Zivid 2+ MR60 77",
    ),
    "genicam": (
        "harvesters.core",
        """
class Camera(Any):
    def __init__(self):
        self.triggered = False
        node_map = Any()
        node_map.ComponentSelector.symbolics = ["Intensity", "Range", "Normal"]
        node_map.TriggerSoftware = Some(execute=lambda: setattr(self, "triggered", True))
        self.remote_device = Some(node_map=node_map)
    @contextmanager
    def fetch(self, timeout):
        assert self.triggered
        grey = (rgb[..., 0].astype(np.uint16) * 4).ravel()
        points = np.where(seen[..., None], xyz, 0).astype(np.float32).ravel()
        parts = [Some(data=grey, width=80, height=60, data_format="Mono10"),
                 Some(data=points, width=80, height=60, data_format="Coord3D_ABC32f")]
        yield Some(payload=Some(components=parts))
class Harvester(Any):
    def add_file(self, path): assert path == "maker.cti"
    def create(self, which):
        assert which == {"serial_number": "77"}
        return Camera()
    @property
    def device_info_list(self): return [Some(model="PhoXi M", serial_number="77")] * CAMERAS
""",
        ["77"],
        "PhoXi M 77",
    ),
}


@pytest.fixture(params=FAKES)
def table(request, tmp_path, monkeypatch):
    """The table of a scanner that is an example, its stand-in on the path; and its name."""
    module, code, words, name = FAKES[request.param]
    place = tmp_path.joinpath("fakes", *module.split(".")).with_suffix(".py")
    place.parent.mkdir(parents=True)
    place.write_text(f"CAMERAS = 1\n{SCENE}{code}")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "fakes"))
    monkeypatch.setenv("GENICAM_PRODUCER", "maker.cti")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    script = str(EXAMPLES / f"{request.param}.py")
    return place, name, {
        "driver": "program",
        "capture": ["{python}", script, "{output}", *words],
        "check": ["{python}", script, "--status"],
        "output": "shot.npz",
        "settle_s": 0,
    }  # fmt: skip


def test_an_example_captures_what_its_camera_sees(table):
    _, name, config = table
    with open_scanner(config) as scanner:
        assert scanner.identity == name
        scan = read_shot(scanner.capture(settings_of(config)()))
    assert isinstance(scan, RangeScan)
    assert scan.points.shape == (60, 80, 3)
    assert not scan.measured[:5, :5].any()
    assert scan.measured[6:].all()
    assert np.ptp(scan.points[6:, :, 2]) == pytest.approx(TILT_MM * 53 / 60, abs=0.01)
    left = scan.points[30, :, 0] < 0  # red lies to the left, X points right: nothing is mirrored
    assert scan.texture[30, :, 0][left].min() > 100 > scan.texture[30, :, 0][~left].max()


def test_an_example_says_that_a_camera_is_missing(table):
    place, _, config = table
    place.write_text(place.read_text().replace("CAMERAS = 1", "CAMERAS = 0"))
    with pytest.raises(DeviceError, match=r"no .* camera is connected"):
        open_scanner(config)


def test_every_example_is_tested_here():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(FAKES)
