"""Presets: the nearest file wins, the base holds elsewhere, and a mistake is told and waited for."""

from __future__ import annotations

import pytest

from restore import Settings
from station.errors import UsageError
from station.run.options import RunOptions


def test_sub_folders_have_their_own_settings(station) -> None:
    station.put("planish.toml", b"points = 200\ndpi = 100\n")
    station.put("fine/planish.toml", b'dpi = 300\noutputs = ["tiff", "map"]\nlanguage = "deu"\n')
    for name in ("a.glb", "fine/b.glb", "fine/deep/c.glb", "plain/d.glb"):
        station.put(name)
    station.run(station.watch(base=RunOptions(Settings(dpi=40, method="sticks"), frozenset({"review"}))))
    calls = {
        name: (settings.points, settings.dpi, settings.method, outputs)
        for name, outputs, settings, _ in station.library.calls
    }
    coarse = (200, 100, "sticks", frozenset({"review"}))
    fine = (200, 300, "sticks", frozenset({"tiff", "map"}))
    assert calls == {"a.glb": coarse, "b.glb": fine, "c.glb": fine, "d.glb": coarse}


def test_the_unit_is_that_of_meshes_alone(station) -> None:
    station.put("fine/planish.toml", b'unit = "7.91um"\n')
    for name in ("a.obj", "b.abs.gz", "fine/c.ply", "fine/d.abs"):
        station.put(name)
    station.run(station.watch(base=RunOptions(unit="cm")))
    assert station.library.units == {"a.obj": "cm", "b.abs.gz": "auto", "c.ply": "7.91um", "d.abs": "auto"}


@pytest.mark.parametrize(
    "text",
    [b"dpi = 1\n", b"colour = 1\n", b'outputs = ["gold"]\n', b"dpi =\n", b"\xff", b"outputs = 3\n"]
    + [b'unit = "ell"\n'],
)
def test_a_mistake_is_reported_once_and_scans_wait_until_it_is_repaired(station, text: bytes) -> None:
    watch = station.watch()
    preset = station.put("sub/planish.toml", text)
    station.put("sub/page.glb")
    station.pass_time(watch, 20.0)
    (reported,) = station.events
    assert reported[0] == "waiting"
    assert "planish.toml" in reported[2]
    preset.write_bytes(b"dpi = 300\n")
    station.pass_time(watch, 10.0)
    assert [settings.dpi for _, _, settings, _ in station.library.calls] == [300]


def test_all_mistakes_of_a_preset_are_reported_at_once(station) -> None:
    station.put("planish.toml", b'dpi = 1\nsize = 2\noutputs = ["gold"]\nlanguage = 3\n')
    station.put("page.glb")
    with pytest.raises(UsageError) as caught:
        station.run()
    for key in ("dpi: 1 is not usable", "size: is not a known setting", "outputs: 'gold'", "language: 3"):
        assert key in str(caught.value)


def test_once_does_not_wait_for_a_mistake(station) -> None:
    station.put("planish.toml", b"dpi = 1\n")
    station.put("page.glb")
    with pytest.raises(UsageError, match="dpi"):
        station.run()
