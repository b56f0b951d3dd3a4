"""The preview's aids against scans whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore import RangeScan
from station.console.state.preview import look_at, window_of
from station.verdict.thresholds import Thresholds
from tests.station.conftest import curl_scan
from tests.station.console.conftest import wait_for

FACTS = {"lens": "MIDDLE", "mode": "fast", "distance_mm": 900}


def test_the_histogram_counts_every_pixel_and_clipping_is_seen():
    scan = curl_scan()
    texture = np.full_like(scan.texture, 100)
    texture[:, :10] = 255
    texture[:, 10:14] = 0
    facts = look_at(replace(scan, texture=texture), Thresholds()).facts
    width, height = facts["width"], facts["height"]
    assert {sum(counts) for counts in facts["histogram"].values()} == {width * height}
    assert facts["histogram"]["r"][255] == 10 * height
    assert facts["clipped"] == {"white": 10 / width, "black": 4 / width}
    assert facts["depth"] is None


def test_the_depth_window_is_that_of_the_lens():
    scan = curl_scan()
    near, far = window_of(FACTS)
    assert near < 900 < far
    facts = look_at(replace(scan, provenance=FACTS), Thresholds()).facts
    depths = -scan.points[..., 2]
    assert facts["depth"]["min"] == depths.min()
    assert facts["depth"]["inside_fraction"] == ((depths >= near) & (depths <= far)).mean()
    points = scan.points.copy()
    points[:, :8, 2] = -(near - 1)
    points[0, -1] = np.nan
    facts = look_at(replace(scan, points=points, provenance=FACTS), Thresholds()).facts
    shares = {one["key"]: one["fraction"] for one in facts["legend"]}
    assert shares["too_near"] > 0.2
    assert shares["too_far"] == 0
    assert 0 < shares["unmeasured"] < 0.1
    assert window_of({}) is None


def test_a_scan_without_colours_is_shown_by_its_depths():
    scan = curl_scan()
    bare = RangeScan(scan.points, None, scan.texture_xy, {})
    seen = look_at(bare, Thresholds(blur_px=(1.2, 2.0)))
    assert (seen.facts["width"], seen.facts["height"]) == scan.points.shape[1::-1]
    assert seen.facts["sharpness"] == {"blur_px": None, "level": ""}


def test_a_preview_is_taken_without_a_session_and_served(served, client):
    assert client.post("/api/press", json={"action": "preview"}).status_code == 202
    facts = wait_for(lambda: (found := client.get("/api/preview")).status_code == 200 and found.json())
    assert (facts["n"], served.scanner.shots[-1].mode) == (1, "fast")
    assert client.get(facts["image"]).content[:2] == b"\xff\xd8"
    assert client.get(facts["overlay"]).content[:4] == b"\x89PNG"
    assert client.get("/api/preview/9.jpg").status_code == 404
    wait_for(lambda: client.get("/api/state").json()["scanner"]["busy"] is None)
    assert served.scanner.places == [(0, 0)]


def test_a_preview_shows_the_leaf_that_the_page_was_captured_from(served, opened):
    for action in ("capture", "capture", "preview", "again", "preview"):
        assert opened.post("/api/press", json={"action": action}).status_code == 202
        wait_for(lambda: opened.get("/api/state").json()["scanner"]["busy"] is None)
    assert served.scanner.places == [(0, 0), (1, 0), (1, 1), (1, 1), (1, 2)]
