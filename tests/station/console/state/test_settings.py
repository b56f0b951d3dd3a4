"""Settings: shown beside the preset, checked before they are taken, taken back by undo, there after a restart."""

from __future__ import annotations

import pytest

from station.session import read_session
from station.session.log.current import preset_of
from tests.station.console.conftest import wait_for


def settings_of(browser) -> dict[str, dict]:
    groups = browser.get("/api/settings").json()["groups"]
    return {one["key"]: one for group in groups for one in group["settings"]}


def change(browser, **values):
    return browser.put(
        "/api/settings", json={"values": {key.replace("__", "."): value for key, value in values.items()}}
    )


def test_settings_say_their_range_their_unit_and_what_the_preset_has(opened):
    found = settings_of(opened)
    dpi = found["restore.dpi"]
    assert (dpi["kind"], dpi["unit"], dpi["min"], dpi["max"]) == ("number", "dpi", 30, 1200)
    assert (dpi["value"], dpi["preset"], dpi["changed"]) == (150, 150, False)
    assert "sticks" in found["restore.method"]["choices"]
    assert found["capture.distance_mm"]["optional"]
    assert (found["verdict.blur_px"]["value"], found["verdict.blur_px"]["unit"]) == ([1.2, 2.0], "px")


def test_a_change_holds_for_what_is_shot_from_now_on_and_undo_takes_it_back(served, opened, root):
    changed = change(opened, restore__dpi=300, capture__mode="fast", verdict__blur_px=[0.1, 0.2])
    assert changed.status_code == 200
    found = settings_of(opened)
    assert (found["restore.dpi"]["value"], found["restore.dpi"]["changed"]) == (300, True)
    opened.post("/api/press", json={"action": "capture"})
    row = wait_for(lambda: (rows := opened.get("/api/pages").json()["pages"]) and rows[0]["level"] and rows[0])
    assert served.scanner.shots[-1].mode == "fast"
    assert served.restorer.calls[-1]["settings"]["dpi"] == 300
    assert "model" in served.restorer.calls[-1]["outputs"]
    assert row["level"] == "red"
    assert preset_of(read_session(root / "missale")).settings["dpi"] == 300
    for _ in range(2):
        opened.post("/api/press", json={"action": "undo"})
    wait_for(lambda: not settings_of(opened)["restore.dpi"]["changed"])
    assert opened.get("/api/state").json()["scanner"]["mode"] == "fine"


def test_changes_are_there_at_the_next_opening_and_null_brings_the_preset_back(opened):
    change(opened, capture__average=4, restore__shading="remove")
    opened.post("/api/close")
    assert settings_of(opened)["capture.average"]["value"] == 1
    opened.post("/api/sessions/missale/open")
    assert settings_of(opened)["capture.average"]["value"] == 4
    change(opened, capture__average=None)
    found = settings_of(opened)
    assert (found["capture.average"]["changed"], found["restore.shading"]["changed"]) == (False, True)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("restore.dpi", 29),
        ("restore.dpi", "many"),
        ("restore.points", 10),
        ("restore.method", "magic"),
        ("capture.mode", "slow"),
        ("capture.mode", 3),
        ("capture.distance_mm", 100),
        ("capture.distance_mm", True),
        ("capture.average", 1.5),
        ("capture.average", 10**30),
        ("capture.gain", [1]),
        ("capture.multi_depth", "yes"),
        ("verdict.blur_px", [1]),
        ("verdict.blur_px", {"a": 1}),
        ("verdict.blur_px", [2.0, 1.2]),
        ("verdict.sampling_ppi", [35, 50]),
        ("verdict.magic", [1, 2]),
        ("magic.dpi", 1),
        ("dpi", 1),
    ],
)
def test_what_is_not_possible_is_refused_by_its_key_and_changes_nothing(opened, key, value):
    refused = opened.put("/api/settings", json={"values": {"restore.dpi": 200, key: value}})
    assert (refused.status_code, refused.json()["error"]["key"]) == (422, "invalid")
    assert refused.json()["error"]["data"]["key"] == key
    assert not any(one["changed"] for one in settings_of(opened).values())


def test_without_a_session_the_capture_alone_is_set(served, client):
    assert {one.partition(".")[0] for one in settings_of(client)} == {"capture"}
    assert change(client, capture__distance_mm=800).status_code == 200
    assert served.app_state.scanner.settings.distance_mm == 800
    assert change(client, restore__dpi=300).status_code == 422
