"""The laptop asleep in the middle of a shot: the server stands still and goes on, before a scanner that does not wait.

The scanner is a simulated one behind a socket, in real time, so that its laser is seen from outside of the server.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.vivid900.profile.profile import SIMULATED, load_profile
from oracles.served_device import served
from oracles.simulation.plate import PlateSensor
from station.session import read_session
from station.session.fixity.verify import verify
from tests.station.console.conftest import TAB, WAIT_S, wait_for

ASLEEP_S = 4.0  # longer than the sweep of a FINE shot: the scanner has ended it when the server wakes
CONFIG = """
[scanner]
driver = "vivid900"
profile = "planish-simulated-0"
transport = {{ kind = "socket", port = {port} }}
[capture]
distance_mm = 900
"""


@pytest.fixture
def device() -> SimulatedDevice:
    return SimulatedDevice(Lens("MIDDLE", 14, PlateSensor()), load_profile(SIMULATED), time.monotonic)


@pytest.fixture
def port(device: SimulatedDevice) -> Iterator[int]:
    with served(device) as port:
        yield port


@pytest.fixture
def station(root: Path, port: int, tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], httpx.Client]]:
    """A server of its own process with the session open, and a browser at it."""
    (tmp_path / "station.toml").write_text(CONFIG.format(port=port))
    command = [sys.executable, "-m", "station", "serve", str(root), "--config", str(tmp_path / "station.toml")]
    command += ["--port", "0", "--index", str(tmp_path / "index")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        link = process.stdout.readline().strip()
        base, _, token = link.partition("/enter?token=")
        headers = {"Authorization": f"Bearer {token}", "X-Planish-Tab": TAB}
        try:
            with httpx.Client(base_url=base, headers=headers, trust_env=False, timeout=WAIT_S) as browser:
                wait_for(lambda: browser.get("/api/state").json()["scanner"]["connected"], "the scanner")
                assert browser.post("/api/sessions/missale/open").status_code == 200
                yield process, browser
        finally:
            os.kill(process.pid, signal.SIGCONT)
            process.send_signal(signal.SIGTERM)
            process.wait(WAIT_S)


def shoot(browser: httpx.Client) -> None:
    assert browser.post("/api/press", json={"action": "capture"}).status_code == 202


def is_stored(browser: httpx.Client, pages: int) -> dict[str, Any] | None:
    """The state, when so many pages are stored and the scanner does nothing."""
    state = dict(browser.get("/api/state").json())
    return state if state["session"]["pages"] == pages and state["scanner"]["busy"] is None else None


@pytest.mark.slow
def test_a_laptop_that_sleeps_in_a_shot_keeps_the_frame_and_the_laser_is_off(station, device, root):
    process, browser = station
    shoot(browser)
    wait_for(lambda: is_stored(browser, 1), "the first page")
    releases = len(list(device.log.named("release")))  # of a shot that nothing interrupts
    shoot(browser)
    wait_for(lambda: len(list(device.log.named("release"))) > releases, "the release")
    os.kill(process.pid, signal.SIGSTOP)
    with pytest.raises(httpx.TimeoutException):
        browser.get("/api/state", timeout=0.5)
    time.sleep(ASLEEP_S)
    assert not device.log.laser_is_on  # the scanner ends its sweep by itself
    os.kill(process.pid, signal.SIGCONT)
    state = wait_for(lambda: is_stored(browser, 2), "the frame")
    assert (state["scanner"]["laser"], state["scanner"]["problem"], state["failed"]) == ("off", None, None)
    assert device.is_parked
    assert len(list(device.log.named("release"))) == 2 * releases  # the frame is read, and not shot once more
    assert [page.capture is not None for page in read_session(root / "missale").history.pages()] == [True, True]
    browser.post("/api/close")
    assert verify(root / "missale").problems == ()
