"""From captures of a program that knows the scanner to a scan, by the commands of docs/how-to/command-profile.md alone.

What the owner does by hand is done here by the text that the commands print: nothing is taken from a true profile.
"""

from __future__ import annotations

import re
import socket
import threading
import tomllib
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from drivers.scanner import ScannerError
from drivers.scsi.in_process import InProcess
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.simulated.serve import listen, serve
from drivers.vivid900.capture.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.link import Link
from drivers.vivid900.profile.profile import load_profile
from drivers.vivid900.settings import VividSettings
from oracles.simulation.plate import PlateSensor
from restore import load_scan
from station.cli import main
from tests.drivers.trace.by_hand import Listener, write

SHOT = VividSettings(mode="fast", distance_mm=900, laser_power=60)
FIELD = re.compile(r"^(\w+) \(.*\) sent: (\w+) = (\{.*\})$", re.MULTILINE)


class Ticking(VirtualClock):
    """Time that passes with every look at it: nobody waits for a device in a test."""

    def __call__(self) -> float:
        self.sleep(0.05)
        return super().__call__()


def vendor_session(variant: str, *shots: VividSettings):
    """What the vendor's program says to the scanner, with its true profile."""
    clock, profile = VirtualClock(), load_profile(f"variants/{variant}")
    listener = Listener(SimulatedDevice(Lens("MIDDLE", 14, PlateSensor()), profile, clock))
    link = Link(InProcess(listener), None, clock, clock.sleep)
    with Vivid900(link, profile, calibrations(None, lens="MIDDLE")) as scanner:
        for shot in shots:
            with suppress(ScannerError):  # at 600 and 1200 mm there is no plate
                scanner.capture(shot)
    return listener.said


@pytest.fixture
def scanner():
    """Serve a scanner of a variant; returns the port, and the device."""
    listeners, threads = [], []

    def scanner(variant: str):
        device = SimulatedDevice(Lens("MIDDLE", 14, PlateSensor()), load_profile(f"variants/{variant}"), Ticking())
        listeners.append(listen())
        threads.append(threading.Thread(target=serve, args=(device, listeners[-1])))
        threads[-1].start()
        return device, listeners[-1].getsockname()[1]

    yield scanner
    for listener in listeners:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
    for thread in threads:
        thread.join()


@pytest.fixture
def planish(capsys):
    """Run a command that has to succeed; returns what it printed."""

    def planish(*arguments: str) -> str:
        assert main(list(arguments)) == 0, capsys.readouterr().err
        return capsys.readouterr().out

    return planish


def fill_in(draft: Path, line: str, text: str) -> None:
    """Replace a comment of the draft, as its owner does in an editor."""
    before = draft.read_text()
    after = re.sub(rf"^# {re.escape(line)} = .*$", text.replace("\\", r"\\"), before, count=1, flags=re.MULTILINE)
    assert after != before, line
    draft.write_text(after)


@pytest.mark.parametrize(
    ("variant", "link_type"),
    [
        ("type-codes", 220),
        pytest.param("little-endian", 249, marks=pytest.mark.slow),
        pytest.param("bare", 249, marks=pytest.mark.slow),
    ],
)
def test_from_captures_to_the_first_scan(variant, link_type, scanner, planish, tmp_path):
    # 1. Captures: both modes, three distances, three powers of the laser; one setting differs at a time.
    def captured(name: str, **changes) -> str:
        shots = [VividSettings(**{**vars(SHOT), **changes, "mode": mode}) for mode in changes.pop("modes", ("fast",))]
        return str(write(tmp_path / f"{name}.pcapng", vendor_session(variant, *shots), link_type))

    both = captured("both", modes=("fine", "fast"))
    series = {
        "distance_mm": {value: captured(f"at-{value}", distance_mm=value) for value in (600, 900, 1200)},
        "laser_power": {value: captured(f"power-{value}", laser_power=value) for value in (20, 21, 60)},
        "mode": {0: captured("fine", modes=("fine",)), 1: captured("fast")},
    }

    # 2. The draft.
    draft = tmp_path / "mine.toml"
    listing = planish("trace", both, "--draft", str(draft))
    assert "read_pitch" in listing
    assert "read_colour" in listing

    # 3. The fields, by what differs.
    for setting, files in series.items():
        values = ",".join(map(str, files))
        reported = FIELD.findall(planish("trace", *files.values(), "--setting", f"{setting}={values}"))
        assert {name for _, name, _ in reported} == {setting}
        role, _, field = reported[0]
        if role == "write_parameters":
            fill_in(draft, setting, f"{setting} = {field}")
        else:  # the data of the release: the byte that changes becomes the field
            at = tomllib.loads(f"field = {field}")["field"]["at"]
            text = draft.read_text()
            data = re.search(r'^release = .* out = "([^"]*)"', text, re.MULTILINE)[1]
            words = data.split()
            words[at] = f"{setting}/1"
            draft.write_text(text.replace(f'out = "{data}"', f'out = "{" ".join(words)}"'))

    # 4. Ask: the profile may not write, the scanner answers.
    device, port = scanner(variant)
    station = tmp_path / "station.toml"
    station.write_text(
        f'[scanner]\ndriver = "vivid900"\nprofile = "{draft}"\nlens = "MIDDLE"\n'
        f'transport = {{ kind = "socket", port = {port} }}\n'
        '[capture]\nmode = "fast"\ndistance_mm = 900\nlaser_power = 60\n'
    )
    reported = planish("query", "--config", str(station))
    assert "not trusted" in reported
    assert "has to be found out" not in reported
    assert f"distance_mm = {device.parameters.distance_mm}" in reported
    assert main(["scan", "--config", str(station), "-o", str(tmp_path / "refused")]) != 0
    assert not {"write_parameters", "release"} & {event.detail for event in device.log.named("command")}

    # 5. Trust, and scan.
    draft.write_text(draft.read_text().replace("trusted = false", "trusted = true", 1))
    out = tmp_path / "out"
    main(["scan", "--config", str(station), "-o", str(out)])  # a plain plate may hold no page: the scan is kept
    scan = load_scan(next(path.parent for path in out.rglob("scan.json")))
    assert device.is_parked

    clock, true = VirtualClock(), load_profile(f"variants/{variant}")
    target = SimulatedDevice(Lens("MIDDLE", 14, PlateSensor()), true, clock)
    link = Link(InProcess(target), None, clock, clock.sleep)
    with Vivid900(link, true, calibrations(None, lens="MIDDLE")) as camera:
        expected = camera.capture(SHOT)
    np.testing.assert_array_equal(scan.points, expected.points.astype(scan.points.dtype))
    np.testing.assert_array_equal(scan.texture, expected.texture)
