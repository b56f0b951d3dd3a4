"""What every driver keeps, whatever its scanner is."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers import DRIVERS, CaptureSettings, SettingsError, open_link, open_scanner, open_turntable, settings_of
from drivers.scanner import TransportError
from restore import load_scan
from tests.drivers.program.conftest import MESH, WRITES

SCENE = {"sheet": "flat", "artwork": "text", "page_mm": [200, 150]}
QUICK = {"simulated": {"mode": "fast", "distance_mm": 900, "laser_power": 60, "gain": 0}}


@pytest.fixture(params=["simulated", "program", "folder"])
def table(request, tmp_path, monkeypatch):
    """The table of a scanner of each driver that needs no device."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "grab.py").write_text(WRITES)
    command = ["{python}", str(tmp_path / "grab.py"), "{output}"]
    (tmp_path / "arriving").mkdir()
    return {
        "folder": {"driver": "folder", "folder": str(tmp_path / "arriving"), "pattern": "*.obj", "settle_s": 0},
        "simulated": {"driver": "simulated", "scene": SCENE},
        "program": {"driver": "program", "capture": command, "output": "shot.obj", "settle_s": 0},
    }[request.param]


def test_a_scanner_captures_and_is_closed_twice(table):
    settings = settings_of(table).of(QUICK.get(table["driver"], {}))
    with open_scanner(table) as scanner:
        if table["driver"] == "folder":
            (Path(table["folder"]) / "shot.obj").write_text(MESH)
        shot = scanner.capture(settings, lambda _step, _done: None)
        scanner.close()
        with pytest.raises(TransportError, match="closed") as caught:
            scanner.capture(settings)
    assert caught.value.hint
    assert dict(shot.provenance)["device"]
    assert hasattr(shot, "points") or load_scan(shot.path, **shot.reading) is not None


def test_raising_from_progress_cancels(table):
    def cancel(_step, _done):
        raise KeyboardInterrupt

    with open_scanner(table) as scanner, pytest.raises(KeyboardInterrupt):
        scanner.capture(settings_of(table).of(QUICK.get(table["driver"], {})), cancel)


def test_settings_are_a_class_of_its_own_and_checked_before_anything_runs(table):
    settings = settings_of(table)
    assert issubclass(settings, CaptureSettings)
    assert settings() == settings.of({})
    assert settings().preview().average == 1
    for wrong in ({"average": 0}, {"average": "1"}, {"nothing": 1}):
        with pytest.raises(SettingsError) as caught:
            settings.of(wrong)
        assert caught.value.hint


def test_a_mistake_in_its_table_has_a_hint(table):
    for ask in (settings_of, open_scanner) if table["driver"] != "simulated" else (open_scanner,):
        with pytest.raises(SettingsError, match="speed") as caught:
            ask({**table, "speed": 1})
        assert caught.value.hint


def test_what_a_driver_does_not_have_is_refused_in_words(table):
    if table["driver"] == "simulated":
        link, _profile = open_link(table)
        link.transport.close()
    else:
        with pytest.raises(SettingsError, match="no commands of its own"):
            open_link(table)
    port = "simulated" if table["driver"] != "simulated" else "/dev/ttyUSB0"
    with pytest.raises(SettingsError, match="do not see each other"), open_turntable(table, model="MMC-2", port=port):
        pass


def test_every_driver_has_its_modules():
    for name, driver in DRIVERS.items():
        assert driver.module.startswith(f"drivers.{name}")
