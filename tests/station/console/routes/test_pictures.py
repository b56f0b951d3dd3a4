"""Pictures and models of a real restoration, against the page and the sheet that were simulated."""

from __future__ import annotations

import io
import math
import shutil
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import httpx
import numpy as np
import pytest
from PIL import Image

from drivers.simulated import Curl, Text, shoot
from restore import RangeScan
from station.console.shown_pages.layers import FILES, ON_CAPTURE
from station.console.shown_pages.strain import OPACITY
from station.console.shown_pages.tiles import OVERLAP, TILE
from station.images.tiff import encode_uncertainty
from station.page_files.model import decode_arrays, encode_arrays
from station.session import Volume, add_scan, create_session, open_session, scan_path
from station.session.derivation.restoration import run_restore
from station.session.log.steps import record_run
from station.session.terms.parts import RESTORE
from station.verdict.packed import PACKED_BYTES, pack
from tests.station.conftest import curl_scan
from tests.station.console.conftest import GatedScanner, Served, StandInRestorer, serving

RADIUS_MM = 60.0
PAGE_MM = (120.0, 80.0)
# The mesh's faces are flat: a chord of 4 samples (a millimetre and a half) on 60 mm is shorter than its arc by 3e-5.
ARC_FRACTION = 2e-3  # with the noise of the simulated scanner, half a millimetre in 300
PARAMETERS = {"settings": {"points": 300, "dpi": 100, "method": "sticks"}, "outputs": ["coverage", "model"]}


@pytest.fixture(scope="module")
def restored(tmp_path_factory) -> tuple[Path, RangeScan]:
    """A session with one page, restored by a method that moves through space."""
    root = tmp_path_factory.mktemp("restored")
    scan, _ = shoot(Curl(radius_mm=RADIUS_MM), Text(), mode="fast", page_mm=PAGE_MM)
    create_session(root / "curl", Volume(title="Curl", preset_values={}))
    with open_session(root / "curl") as writer:
        capture = add_scan(writer, scan, facts={"by": "a test"})
        folder = writer.staging("restore")
        run = run_restore(scan_path(writer.session, capture), PARAMETERS, folder)
        assert "error" not in run.result
        record_run(writer, RESTORE, capture, parameters=PARAMETERS, result=run.result, files=folder)
    return root, scan


@pytest.fixture
def viewed(restored) -> Iterator[tuple[httpx.Client, Served]]:
    """A browser that looks at that session."""
    root, scan = restored
    with serving(root, GatedScanner(scan), StandInRestorer()) as served, served.client() as browser:
        assert browser.post("/api/sessions/curl/open", json={"read_only": True}).status_code == 200
        yield browser, served


def picture_of(answer: httpx.Response) -> np.ndarray:
    assert answer.status_code == 200
    return np.asarray(Image.open(io.BytesIO(answer.content)))


def dzi_size(browser: httpx.Client, event: int, layer: str) -> tuple[int, int]:
    document = ElementTree.fromstring(browser.get(f"/api/pictures/{event}/{layer}.dzi").text)
    size = document.find("{*}Size")
    return int(size.get("Width")), int(size.get("Height"))


def test_tiles_put_together_are_the_page(viewed):
    browser, _ = viewed
    row = browser.get("/api/pages").json()["pages"][0]
    event = row["restore"]
    width, height = dzi_size(browser, event, "page")
    stored = picture_of(browser.get(f"/api/pictures/{event}/page/full"))
    assert stored.shape[:2] == (height, width)
    assert browser.get("/api/pages/1").json()["page_px"] == [width, height]
    level = math.ceil(math.log2(max(width, height)))
    whole = np.zeros_like(stored)
    for row_ in range(math.ceil(height / TILE)):
        for column in range(math.ceil(width / TILE)):
            answer = browser.get(f"/api/pictures/{event}/page_files/{level}/{column}_{row_}.jpg")
            tile = picture_of(answer)
            left, top = max(column * TILE - OVERLAP, 0), max(row_ * TILE - OVERLAP, 0)
            whole[top : top + tile.shape[0], left : left + tile.shape[1]] = tile
    assert np.abs(whole.astype(int) - stored).mean() < 3.0  # what JPEG changes
    assert "immutable" in answer.headers["cache-control"]
    assert picture_of(browser.get(f"/api/pictures/{event}/page_files/0/0_0.jpg")).shape == (1, 1, 3)
    thumbnail = picture_of(browser.get(f"/api/pictures/{event}/page/thumbnail.jpg"))
    assert max(thumbnail.shape[:2]) == 240


def test_layers_of_a_page_register(viewed):
    browser, _ = viewed
    row = browser.get("/api/pages").json()["pages"][0]
    detail = browser.get("/api/pages/1").json()
    assert detail["layers"] == ["page", "coverage", "strain", "original"]
    assert detail["models"] == ["scan", "mesh", "steps"]
    sizes = {dzi_size(browser, row["restore"], layer) for layer in ("page", "coverage", "strain")}
    assert len(sizes) == 1
    strain = picture_of(browser.get(f"/api/pictures/{row['restore']}/strain/full"))
    assert (strain[..., 3] > 0).mean() > 0.98
    original = picture_of(browser.get(f"/api/pictures/{row['capture']}/original/full"))
    assert original.shape == (480, 640, 3)
    scale = browser.get(f"/api/pictures/{row['restore']}/strain/scale").json()
    assert 0 < scale["stretch"]["rms"] <= scale["end"]
    legend = {one["key"]: one for one in browser.get(f"/api/pictures/{row['restore']}/coverage/legend").json()["kinds"]}
    assert legend["measured"]["colour"] is None
    assert sum(one["fraction"] for one in legend.values()) == pytest.approx(1.0)


def test_models_hold_every_point_and_the_steps_between(viewed, restored):
    browser, _ = viewed
    _, scan = restored
    row = browser.get("/api/pages").json()["pages"][0]
    arrays, facts = decode_arrays(browser.get(f"/api/models/{row['capture']}/scan").content)
    measured = int(scan.measured.sum())
    assert (facts["kind"], arrays["vertices"].shape, arrays["uv"].shape) == ("scan", (measured, 3), (measured, 2))
    assert arrays["faces"].max() < measured
    assert "faces" not in decode_arrays(browser.get(f"/api/models/{row['capture']}/scan?faces=0").content)[0]
    normals = np.cross(
        *(arrays["vertices"][arrays["faces"][:, k]] - arrays["vertices"][arrays["faces"][:, 0]] for k in (1, 2))
    )
    assert (normals[:, 2] > 0).mean() > 0.99  # they face the scanner
    mesh, facts = decode_arrays(browser.get(f"/api/models/{row['restore']}/mesh").content)
    count = len(mesh["vertices"])
    assert {name: array.shape for name, array in mesh.items() if name != "faces"} == {
        "vertices": (count, 3),
        "flat": (count, 2),
        "strain": (count,),
        "uv": (count, 2),
        "page_uv": (count, 2),
    }
    assert facts["texture"] == f"/api/pictures/{row['capture']}/original/full"
    assert mesh["page_uv"].min() > -0.01
    assert mesh["page_uv"].max() < 1.01
    assert np.ptp(mesh["flat"], axis=0) == pytest.approx(PAGE_MM, abs=1.0)
    steps, _ = decode_arrays(browser.get(f"/api/models/{row['restore']}/steps").content)
    heights = np.ptp(steps["positions"][..., 2], axis=1)
    assert heights[0] > 10
    assert heights[-1] < heights[0] / 5  # the steps of that method end before the last of the height is gone
    assert len(steps["step"]) == len(steps["positions"])


def test_a_line_on_the_page_is_as_long_on_the_sheet_and_shorter_through_space(viewed):
    browser, _ = viewed
    row = browser.get("/api/pages").json()["pages"][0]
    ask = f"/api/models/{row['restore']}/measure"
    found = browser.get(ask, params={"x0": 10, "y0": 40, "x1": 110, "y1": 40}).json()
    assert found["page_mm"] == pytest.approx(100.0)
    assert found["sheet_mm"] == pytest.approx(100.0, rel=ARC_FRACTION)
    # The chord of an arc of 100 mm: 2 r sin(s / 2r), r from 46 to 86 mm along the taper of the sheet.
    assert 2 * 46 * math.sin(100 / 92) < found["chord_mm"] < 2 * 86 * math.sin(100 / 172)
    along = browser.get(ask, params={"x0": 60, "y0": 5, "x1": 60, "y1": 75}).json()
    assert along["chord_mm"] == pytest.approx(70.0, rel=ARC_FRACTION)  # a ruling of the cylinder is straight
    assert len(along["line"]) <= 200
    nothing = browser.get(ask, params={"x0": 60, "y0": 5, "x1": 60, "y1": 5}).json()
    assert (nothing["page_mm"], nothing["sheet_mm"]) == (0.0, 0.0)
    assert browser.get(ask, params={"x0": -20, "y0": 5, "x1": 60, "y1": 5}).json()["error"]["key"] == "off_page"
    assert browser.get(ask, params={"x0": "nan", "y0": 5, "x1": 60, "y1": 5}).status_code == 422


def test_what_is_not_there_is_not_found(viewed):
    browser, _ = viewed
    row = browser.get("/api/pages").json()["pages"][0]
    for path in (
        f"pictures/{row['restore']}/master.dzi",
        f"pictures/{row['capture']}/page.dzi",
        f"pictures/{row['restore']}/original.dzi",
        f"pictures/{row['capture']}/uncertainty/scale",
        f"pictures/{row['restore']}/uncertainty/scale",
        "pictures/999/page.dzi",
        f"pictures/{row['restore']}/page_files/30/0_0.jpg",
        f"pictures/{row['restore']}/page_files/3/9_0.jpg",
        f"pictures/{row['restore']}/page_files/3/0_0.png",
        f"models/{row['capture']}/mesh",
        f"models/{row['restore']}/scan",
    ):
        assert browser.get(f"/api/{path}").status_code == 404, path
    assert browser.get(f"/api/pictures/{row['restore']}/secret.dzi").status_code == 422
    assert {*FILES, ON_CAPTURE} == {"page", "master", "coverage", "strain", "uncertainty", "original"}


def test_links_and_damaged_pictures_of_a_session_are_refused(restored, tmp_path):
    """A session that somebody prepared: a picture that is a link to a secret, one of a billion pixels, one of noise."""
    root, scan = restored
    shutil.copytree(root / "curl", tmp_path / "curl")
    with serving(tmp_path, GatedScanner(scan), StandInRestorer()) as served, served.client() as browser:
        browser.post("/api/sessions/curl/open", json={"read_only": True})
        row = browser.get("/api/pages").json()["pages"][0]
        session = served.app_state.opened().session
        page = session.path(session.history.event(row["restore"]), "page.png")
        secret = tmp_path / "secret.png"
        shutil.copy(page, secret)
        page.unlink()
        page.symlink_to(secret)
        assert browser.get(f"/api/pictures/{row['restore']}/page/full").status_code == 422
        assert browser.get(f"/api/pictures/{row['restore']}/page.dzi").status_code == 422
        page.unlink()
        bomb = bytearray(secret.read_bytes())
        bomb[16:24] = (100_000).to_bytes(4, "big") * 2
        for data in (bytes(bomb), b"noise", secret.read_bytes()[:500]):
            page.write_bytes(data)
            answer = browser.get(f"/api/pictures/{row['restore']}/page.dzi")
            assert (answer.status_code, answer.json()["error"]["key"]) == (422, "damaged")
        points = next(session.path(session.history.event(row["capture"])).rglob("points.npz"))
        points.unlink()
        points.symlink_to(secret)
        assert browser.get(f"/api/models/{row['capture']}/scan").status_code == 422


def test_both_leaves_of_an_opened_book_are_shown(tmp_path):
    """Two pictures of one restoration, each with its layers, by the name of its leaf."""
    widths = {"left": 50, "right": 40}
    create_session(tmp_path / "book", Volume(title="Book", preset_values={}))
    with open_session(tmp_path / "book") as writer:
        capture = add_scan(writer, curl_scan(), facts={})
        made = writer.staging("run")
        made.mkdir()
        for part, width in widths.items():
            Image.fromarray(np.full((30, width, 3), width, np.uint8)).save(made / f"page-{part}.png")
            Image.fromarray(np.ones((30, width), np.uint8)).save(made / f"page-{part}-coverage.png")
        measures = {"fingerprint": pack(bytes(PACKED_BYTES))}
        parts = {part: {"page_mm": [w, 30.0], "dpi": 25.4, "measures": measures} for part, w in widths.items()}
        event = record_run(writer, RESTORE, capture, parameters={}, result={"parts": parts}, files=made).number
    with serving(tmp_path, GatedScanner(curl_scan()), StandInRestorer()) as served, served.client() as browser:
        opened = browser.post("/api/sessions/book/open", json={"read_only": True})
        assert opened.status_code == 200, opened.text
        leaves = browser.get("/api/pages/1").json()["leaves"]
        assert [(leaf["part"], leaf["prefix"], leaf["page_px"]) for leaf in leaves] == [
            ("left", "left.", [50, 30]),
            ("right", "right.", [40, 30]),
        ]
        assert leaves[1]["layers"] == ["page", "coverage"]
        for leaf, width in widths.items():
            assert dzi_size(browser, event, f"{leaf}.page") == (width, 30)
            assert picture_of(browser.get(f"/api/pictures/{event}/{leaf}.page/full"))[0, 0, 0] == width
            assert picture_of(browser.get(f"/api/pictures/{event}/{leaf}.page/thumbnail.jpg")).shape[:2] == (30, width)
            assert picture_of(browser.get(f"/api/pictures/{event}/{leaf}.coverage/full")).shape[:2] == (30, width)
            assert browser.get(f"/api/pictures/{event}/coverage/legend?leaf={leaf}.").status_code == 200
        assert browser.get(f"/api/pictures/{event}/page.dzi").status_code == 404
        assert browser.get(f"/api/pictures/{event}/left.strain.dzi").status_code == 404
        for wrong in ("middle.page", "left.original", "left..page"):
            assert browser.get(f"/api/pictures/{event}/{wrong}.dzi").status_code in (404, 422)


def tilted(width, turn):
    """The model of a leaf of width × 30 mm that rises in space by `turn` mm for each across."""
    flat = np.array([[0.0, 0.0], [width, 0.0], [width, 30.0], [0.0, 30.0]], np.float32)
    vertices = np.column_stack([flat, turn * flat[:, 0]]).astype(np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    arrays = {
        "vertices": vertices,
        "flat": flat,
        "strain": np.zeros(4, np.float32),
        "page_uv": flat / np.array([width, 30.0], np.float32),
        "faces": faces,
    }
    return encode_arrays(arrays, {"dpi": 25.4})


def test_each_leaf_of_an_opened_book_has_its_ruler_and_its_model(tmp_path):
    """Slopes of 3:4 and of 5:12, whose lengths are whole numbers."""
    leaves = {"left": (48.0, 3 / 4), "right": (36.0, 5 / 12)}
    create_session(tmp_path / "book", Volume(title="Book", preset_values={}))
    with open_session(tmp_path / "book") as writer:
        capture = add_scan(writer, curl_scan(), facts={})
        made = writer.staging("run")
        made.mkdir()
        for part, (width, turn) in leaves.items():
            (made / f"page-{part}-model.plm").write_bytes(tilted(width, turn))
            Image.fromarray(np.zeros((30, int(width), 3), np.uint8)).save(made / f"page-{part}.png")
        measures = {"fingerprint": pack(bytes(PACKED_BYTES))}
        parts = {part: {"page_mm": [width, 30.0], "measures": measures} for part, (width, _) in leaves.items()}
        event = record_run(writer, RESTORE, capture, parameters={}, result={"parts": parts}, files=made).number
    line = {"x0": 6, "y0": 15, "x1": 18, "y1": 15}
    with serving(tmp_path, GatedScanner(curl_scan()), StandInRestorer()) as served, served.client() as browser:
        assert browser.post("/api/sessions/book/open", json={"read_only": True}).status_code == 200
        assert browser.get("/api/pages/1").json()["models"] == ["scan", "mesh"]
        for part, sheet_mm in (("left", 15.0), ("right", 13.0), ("left", 15.0)):
            leaf = {"leaf": f"{part}."}
            measured = browser.get(f"/api/models/{event}/measure", params={**line, **leaf}).json()
            assert measured["page_mm"] == 12.0
            assert measured["sheet_mm"] == pytest.approx(sheet_mm, abs=1e-3)
            _, facts = decode_arrays(browser.get(f"/api/models/{event}/mesh", params=leaf).content)
            assert facts["page_mm"] == [leaves[part][0], 30.0]
        for path in ("measure", "mesh"):
            answer = browser.get(f"/api/models/{event}/{path}", params=line)
            assert answer.json()["error"]["key"] == "not_recorded", path


@pytest.fixture
def uncertain(tmp_path) -> Iterator[tuple[httpx.Client, int, Path]]:
    """A browser, a restoration that estimated its uncertainty, and the file of that."""
    values = np.tile(np.linspace(0.0, 0.02, 40, dtype=np.float32), (30, 1))
    values[:, :5] = np.nan
    create_session(tmp_path / "book", Volume(title="Book", preset_values={}))
    with open_session(tmp_path / "book") as writer:
        capture = add_scan(writer, curl_scan(), facts={})
        made = writer.staging("run")
        made.mkdir()
        Image.fromarray(np.zeros((30, 40, 3), np.uint8)).save(made / "page.png")
        (made / "page-uncertainty.tif").write_bytes(encode_uncertainty(values, 150))
        result = {"page_mm": [40.0, 30.0], "measures": {"fingerprint": pack(bytes(PACKED_BYTES))}}
        result["uncertainty_mm"] = {"noise": 0.005, "method": 0.01, "total": 0.0112, "p95": 0.027}
        event = record_run(writer, RESTORE, capture, parameters={}, result=result, files=made)
        stored = writer.session.path(event, "page-uncertainty.tif")
    with serving(tmp_path, GatedScanner(curl_scan()), StandInRestorer()) as served, served.client() as browser:
        assert browser.post("/api/sessions/book/open", json={"read_only": True}).status_code == 200
        yield browser, event.number, stored


def test_the_uncertainty_is_a_layer_with_its_scale(uncertain):
    browser, event, _ = uncertain
    assert browser.get("/api/pages/1").json()["layers"] == ["page", "uncertainty", "original"]
    assert dzi_size(browser, event, "uncertainty") == dzi_size(browser, event, "page")
    picture = picture_of(browser.get(f"/api/pictures/{event}/uncertainty/full"))
    assert set(picture[:, :5, 3].ravel()) == {0}
    assert set(picture[:, 5:, 3].ravel()) == {OPACITY}
    assert (np.diff(picture[0, 5:, :3].sum(axis=1, dtype=int)) <= 0).all()  # darker where less is known
    scale = browser.get(f"/api/pictures/{event}/uncertainty/scale").json()
    assert (scale["end"], scale["unit"], scale["uncertainty_mm"]["total"]) == (0.02, "mm", 0.0112)
    assert browser.get(f"/api/pictures/{event}/uncertainty_files/6/0_0.png").status_code == 200


@pytest.mark.parametrize("name", ["uncertainty/full", "uncertainty/scale", "uncertainty.dzi"])
def test_a_damaged_uncertainty_is_a_fault(uncertain, name):
    browser, event, stored = uncertain
    png = io.BytesIO()
    Image.new("L", (40, 30)).save(png, "PNG")
    for data in (stored.read_bytes()[:-200], b"", png.getvalue()):
        stored.chmod(0o600)
        stored.write_bytes(data)
        answer = browser.get(f"/api/pictures/{event}/{name}")
        assert (answer.status_code, answer.json()["error"]["key"]) == (422, "damaged")
