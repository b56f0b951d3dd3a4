"""A scanner that is not a Vivid 900 in the console: only what is known of it is shown."""

from __future__ import annotations

import pytest

from station.config import StationConfig
from tests.station.conftest import curl_scan
from tests.station.console.conftest import GatedScanner, StandInRestorer, serving, wait_for
from tests.station.console.state.test_settings import settings_of

GAIN = {"default": 2, "low": 0, "high": 7, "unit": "dB", "text": "gain of the camera"}
CONFIG = StationConfig(scanner={"driver": "program", "capture": ["{python}", "{output}"], "settings": {"gain": GAIN}})


class HandTriggered(GatedScanner):
    """A scanner with a number of shots that wait; each capture takes one."""

    waiting = 0

    def wait(self, _seconds):
        return self.waiting > 0

    def capture(self, settings, progress):
        self.waiting -= 1
        return super().capture(settings, progress)


@pytest.fixture
def browser(root):
    """A browser before it, and the scanner."""
    scanner = HandTriggered(curl_scan())
    with serving(root, scanner, StandInRestorer(), config=CONFIG) as served, served.client() as client:
        yield client, scanner


def test_the_settings_are_those_that_its_table_declares(browser):
    client, scanner = browser
    assert client.post("/api/sessions/missale/open").status_code == 200
    found = settings_of(client)
    assert [key for key in found if key.startswith("capture.")] == [
        "capture.gain", "capture.average", "capture.deadline_s",
    ]  # fmt: skip
    gain = found["capture.gain"]
    assert [gain[name] for name in ("kind", "value", "min", "max", "unit", "description")] == [
        "integer", 2, 0, 7, "dB", "gain of the camera",
    ]  # fmt: skip
    assert "verdict.blur_px" in found
    assert "verdict.depth_window_fraction" not in found
    assert client.put("/api/settings", json={"values": {"capture.gain": 8}}).status_code == 422
    assert client.put("/api/settings", json={"values": {"capture.gain": 5}}).status_code == 200
    scanner.waiting = 1
    wait_for(lambda: scanner.shots, "the shot")
    assert scanner.shots[0].gain == 5


def test_nothing_is_claimed_of_its_laser_lens_and_mode(browser):
    shown = browser[0].get("/api/state").json()["scanner"]
    assert [shown[name] for name in ("laser", "lens", "mode", "distance_mm")] == [None] * 4


def test_each_shot_that_waits_is_a_page_without_a_key_or_a_preview(browser):
    client, scanner = browser
    assert client.post("/api/sessions/missale/open").status_code == 200
    scanner.waiting = 2
    wait_for(lambda: len(client.get("/api/pages").json()["pages"]) == 2, "two pages")
    assert (scanner.waiting, len(scanner.shots)) == (0, 2)
    assert client.post("/api/press", json={"action": "preview"}).json()["error"]["key"] == "no_preview"
