"""Driver and device as two ends of a socket, and as two processes."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from drivers import open_scanner
from drivers.scanner import TransportError
from drivers.scsi.tcp import TcpDevice
from drivers.scsi.transport import CHECK_CONDITION
from drivers.simulated.__main__ import main
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.simulated.serve import listen
from drivers.vivid900.config import Socket
from drivers.vivid900.connecting import open_transport
from drivers.vivid900.link import Link
from drivers.vivid900.profile.profile import SIMULATED, load_profile
from drivers.vivid900.settings import VividSettings
from oracles.served_device import served
from oracles.simulation.plate import PlateSensor
from station.storage.folder_lock import WORK

SET = VividSettings(mode="fast", distance_mm=900, laser_power=68, gain=0)
CONFIG = '[scanner]\ndriver = "simulated"\n[scanner.scene]\nsheet = "flat"\nartwork = "white"\ntable = "none"\n'
WORKER = """
[scanner]
driver = "vivid900"
profile = "planish-simulated-0"
transport = {{ kind = "socket", port = {port} }}
[capture]
distance_mm = 900
laser_power = 68
average = 50
"""
LONGEST_SWEEP_S = 2.5


class Ticking(VirtualClock):
    """Time that passes with every look at it: nobody waits for a device in a test."""

    def __call__(self) -> float:
        self.sleep(0.2)
        return super().__call__()


@pytest.fixture
def device() -> SimulatedDevice:
    return SimulatedDevice(Lens("MIDDLE", 14, PlateSensor()), load_profile(SIMULATED), Ticking())


@pytest.fixture
def port(device: SimulatedDevice) -> Iterator[int]:
    with served(device) as port:
        yield port


def table(port: int) -> dict[str, object]:
    return {"driver": "vivid900", "profile": SIMULATED, "transport": {"kind": "socket", "port": port}}


def test_a_scan_over_a_socket(port: int) -> None:
    for _ in range(2):  # the device outlives the first driver
        with open_scanner(table(port)) as scanner:
            scan = scanner.capture(SET)
        assert scan.measured.all()
        assert np.ptp(scan.points[..., 2]) < 0.01


def test_standard_commands_and_sense_data_come_through(port: int) -> None:
    transport = open_transport(Socket(kind="socket", port=port))
    assert Link(transport).identify().product == "SIM VIVID 900"
    first = transport.execute(bytes(6))
    assert first.status == CHECK_CONDITION
    assert first.sense[2] & 0x0F == 6
    transport.close()
    transport.close()
    with pytest.raises(TransportError, match="closed"):
        transport.execute(bytes(6))


def test_a_refused_connection_is_reported() -> None:
    with listen() as taken:
        free = taken.getsockname()[1]
    with pytest.raises(TransportError, match="no server listens"):
        TcpDevice("127.0.0.1", free)


@pytest.mark.parametrize("answer", ["", "00 00", "ff ff ff ff", "00 00 00 01 00", "00 00 00 02 02 09"])
def test_an_invalid_answer_ends_the_connection(answer: str) -> None:
    with listen() as listener:
        transport = TcpDevice("127.0.0.1", listener.getsockname()[1])
        end, _ = listener.accept()
        with end:
            end.sendall(bytes.fromhex(answer))
            end.shutdown(socket.SHUT_WR)
            with pytest.raises(TransportError):
                transport.execute(bytes(6))
        transport.close()


def test_a_silent_device_times_out() -> None:
    with listen() as listener:
        transport = TcpDevice("127.0.0.1", listener.getsockname()[1])
        with pytest.raises(TransportError, match="does not answer"):
            transport.execute(bytes(6), timeout=0.05)
        first, _ = listener.accept()
        with first, pytest.raises(TransportError, match="does not answer"):
            transport.execute(bytes(6), timeout=0.05)
        second, _ = listener.accept()  # a late answer to the first would have been taken for the second's
        second.close()
        transport.close()


@pytest.mark.slow
def test_two_processes(tmp_path: Path, repository: Path) -> None:
    (tmp_path / "station.toml").write_text(CONFIG)
    command = [sys.executable, "-m", "drivers.simulated", str(tmp_path / "station.toml")]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(repository)}
    ) as process:
        assert process.stdout is not None
        try:
            port = int(process.stdout.readline().split(":")[1])
            with open_scanner(table(port)) as scanner:
                scan = scanner.capture(SET)
        finally:
            process.send_signal(signal.SIGINT)
            with suppress(subprocess.TimeoutExpired):
                process.wait(10)
            process.kill()
    assert process.returncode == 130
    assert scan.measured.mean() > 0.5
    assert scan.provenance["device"] == "PLANISH SIM VIVID 900 0.9"


@pytest.mark.slow
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_worker_that_is_ended_in_the_middle_of_a_shot(
    device: SimulatedDevice, port: int, tmp_path: Path, repository: Path, ending: signal.Signals
) -> None:
    """Told to end, it parks the scanner; killed, the laser goes out with the sweep, and the next driver parks it."""
    (tmp_path / "station.toml").write_text(WORKER.format(port=port))
    command = [sys.executable, "-m", "station", "scan", "--config", "station.toml", "-o", "out"]
    environment = {**os.environ, "PYTHONPATH": str(repository)}
    with subprocess.Popen(command, cwd=tmp_path, env=environment, stderr=subprocess.DEVNULL) as worker:
        while not any(device.log.named("release")):
            assert worker.poll() is None
            time.sleep(0.01)
        worker.send_signal(ending)
        code = worker.wait(60)
    assert code in (130, 128 + ending, -ending)
    if ending == signal.SIGKILL:
        device.log.clock.sleep(LONGEST_SWEEP_S)
        assert not device.log.laser_is_on
        open_scanner(table(port)).close()
    assert device.is_parked
    # A killed run cannot release its lock of the folder: the next run there does.
    left_behind = {WORK} if ending == signal.SIGKILL else set()
    assert {path.name for path in (tmp_path / "out").glob("*")} <= left_behind


def test_an_invalid_configuration_is_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["drivers.simulated", "none.toml"])
    assert main() == 2
    assert "none.toml" in capsys.readouterr().err
