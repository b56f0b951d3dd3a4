"""`planish park`: scanner and stage made safe after a run that was killed, each even when the other fails."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.scanner import LASER_MAY_BE_ON, DeviceError
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.simulated.device.stage import PtyStage, machine
from drivers.simulated.serve import listen
from drivers.vivid900.profile.profile import SIMULATED, load_profile
from oracles.served_device import served
from oracles.simulation.plate import PlateSensor
from station.cli import main
from station.errors import explain

SCANNER = """
[scanner]
driver = "vivid900"
profile = "planish-simulated-0"
transport = {{ kind = "socket", port = {port} }}
"""
STAGE = '[turntable]\nmodel = "MMC-2"\nport = "{port}"\n'
FOLLOW_S = 5.0  # for the stage's thread to read a stop


@pytest.fixture
def killed():
    """A device as a killed run leaves it, the laser's power set, and the port that it listens at."""
    device = SimulatedDevice(Lens("MIDDLE", 14, PlateSensor()), load_profile(SIMULATED), VirtualClock())
    device.parameters = replace(device.parameters, laser_power=200)
    with served(device) as port:
        yield device, port


@pytest.fixture
def turning():
    """A stage in the middle of a turn."""
    with PtyStage(machine("MMC-2"), clock=time.monotonic) as stage:
        stage.machine.axle.go(100_000, 100.0, stage.clock())
        assert stage.moving
        yield stage


def station(tmp_path: Path, *tables: str) -> str:
    path = tmp_path / "station.toml"
    path.write_text("".join(tables))
    return str(path)


def stands(stage: PtyStage) -> bool:
    end = time.monotonic() + FOLLOW_S
    while stage.moving and time.monotonic() < end:
        time.sleep(0.05)
    return not stage.moving


def test_laser_and_stage_of_a_killed_run(tmp_path, killed, turning, capsys) -> None:
    device, port = killed
    config = station(tmp_path, SCANNER.format(port=port), STAGE.format(port=turning.port))
    assert main(["park", "--config", config]) == 0
    assert device.is_parked
    assert stands(turning)
    assert capsys.readouterr().out.splitlines() == ["scanner: the laser is off", "turntable: stopped"]


def test_the_stage_is_stopped_when_the_scanner_does_not_answer(tmp_path, turning, capsys) -> None:
    with listen() as listener:
        no_one = listener.getsockname()[1]
    config = station(tmp_path, SCANNER.format(port=no_one), STAGE.format(port=turning.port))
    assert main(["park", "--config", config]) == 4
    assert stands(turning)
    assert capsys.readouterr().err.splitlines()[-1].strip() == LASER_MAY_BE_ON


def test_the_laser_is_off_when_the_stage_does_not_answer(tmp_path, killed, capsys) -> None:
    device, port = killed
    config = station(tmp_path, SCANNER.format(port=port), STAGE.format(port=tmp_path / "nothing"))
    assert main(["park", "--config", config]) == 4
    assert device.is_parked
    assert LASER_MAY_BE_ON not in capsys.readouterr().err


def test_a_simulated_station_is_parked(capsys) -> None:
    assert main(["park", "--config", "configs/simulated-turntable.toml"]) == 0
    assert capsys.readouterr().out == "scanner: the laser is off\n"


def test_the_warning_is_the_last_line_and_said_once() -> None:
    error = DeviceError("the motor has failed", "it needs service")
    for note in ("and the scanner could not be brought to rest: no answer", LASER_MAY_BE_ON, LASER_MAY_BE_ON, "saved"):
        error.add_note(note)
    assert explain(error).hints[-1] == LASER_MAY_BE_ON
    assert explain(error).hints.count(LASER_MAY_BE_ON) == 1
