"""Every way out of a capture: signals, a full disk, kill -9, and what must hold after each: the laser is off."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from time import monotonic
from types import FrameType
from typing import Any, TypeVar

from drivers.safety.signals import ENDING_SIGNALS
from drivers.scanner import ScannerError
from drivers.scsi.replay import Recorder
from drivers.scsi.transport import Reply, Target
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.simulated.serve import listen, serve
from drivers.vivid900.connecting import connect
from drivers.vivid900.profile.profile import SIMULATED, load_profile
from oracles.bus_faults import SgRig, UsbRig
from oracles.faults import SETTINGS, FaultRig
from oracles.simulation.buses.sg_node import SimulatedSgNode
from oracles.simulation.buses.usb_bridge import SimulatedBridge
from oracles.simulation.buses.usb_descriptors import HIGH_SPEED
from oracles.simulation.device_faults import Call, FaultyDevice
from oracles.simulation.plate import PlateSensor

Result = TypeVar("Result")
KILLED_STATUS = -signal.SIGKILL
NOT_KILLED = "not killed"  # in place of a violation: the capture had ended before
STARTED_S = 60.0  # a program that imports the driver on a busy machine
CHILD = """
import sys
from drivers import open_scanner
from drivers.vivid900.settings import VividSettings
config = {"driver": "vivid900", "profile": sys.argv[2], "transport": {"kind": "socket", "port": int(sys.argv[1])}}
with open_scanner(config) as scanner:
    scanner.capture(VividSettings(mode="fast", laser_power=68, gain=0))
"""


class Ended(BaseException):
    """Raised by the program's handler of a signal."""


class Killed(BaseException):
    """Raised where the process would be gone: it is caught outside the driver, and nothing reaches the bus after it."""


@contextmanager
def ending_handlers() -> Iterator[Callable[[int, FrameType | None], None]]:
    """Every ending signal raises Ended, as at the station, by the handler that is given."""

    def end(number: int, _frame: FrameType | None) -> None:
        raise Ended(number)

    before = {number: signal.signal(number, end) for number in ENDING_SIGNALS}
    try:
        yield end
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def signal_violation(rig: FaultRig, number: int, times: int, command: int) -> str:
    """What is wrong after a signal at each of so many commands of a capture, or empty. Needs `ending_handlers`."""

    def struck(faulty: FaultyDevice, call: Call) -> Reply:
        reply = faulty.no_fault(call)
        signal.raise_signal(number)
        return reply

    rig.connection.set_script({command + k: struck for k in range(times)})
    rig.stops, start = 0, rig.clock()
    try:
        rig.camera.capture(SETTINGS)
        return "the signal was lost"
    except Ended:
        return rig.rest_violation(start) or rig.next_capture_violation()


def full_disk_violation(rig: FaultRig, limit: int) -> str:
    """What is wrong with a capture whose recording the disk takes only so many bytes of, or empty."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    transport = rig.camera._link.transport
    rig.connection.set_script({})
    rig.stops, start, shot = 0, rig.clock(), rig.device.shot
    try:
        with suppress(OSError), tempfile.TemporaryFile("w") as file:  # closing writes what is left, which is refused
            rig.camera._link = replace(rig.camera._link, transport=Recorder(transport, file))
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
            try:
                wrong = rig.scan_violation(rig.camera.capture(SETTINGS), shot)
            except ScannerError as error:
                wrong = f"the capture failed: {error}"
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
        rig.camera._link = replace(rig.camera._link, transport=transport)
    return wrong or rig.rest_violation(start)


def recorded_bytes(rig: FaultRig, path: Path) -> int:
    """Length of the recording of a capture."""
    transport = rig.camera._link.transport
    with path.open("w") as file:
        rig.camera._link = replace(rig.camera._link, transport=Recorder(transport, file))
        rig.camera.capture(SETTINGS)
    rig.camera._link = replace(rig.camera._link, transport=transport)
    return path.stat().st_size


class Lifeline:
    """A process that dies at one of its calls to the kernel; from there on no call has an effect.

    calls   number of calls so far; dies_at: that at which it dies; after: whether that one still has its effect.
    """

    def __init__(self) -> None:
        self.calls, self.dies_at, self.after, self.dead = 0, -1, False, False

    def step(self, call: Callable[[], Result]) -> Result:
        """Do one call. Raises Killed at the fatal one and after it."""
        if self.dead:
            raise Killed
        fatal = self.calls == self.dies_at
        self.calls += 1
        if fatal:
            self.dead = True
            if self.after:
                call()
            raise Killed
        return call()


class _MortalBridge(SimulatedBridge):
    """A bridge and its kernel, used by a process that dies."""

    def __init__(self, life: Lifeline, target: Target, **options: Any) -> None:
        super().__init__(target, **options)
        self._life = life

    def bulk_write(self, *arguments: Any) -> int:
        return self._life.step(lambda: SimulatedBridge.bulk_write(self, *arguments))

    def bulk_read(self, *arguments: Any) -> int:
        return self._life.step(lambda: SimulatedBridge.bulk_read(self, *arguments))

    def ctrl_transfer(self, *arguments: Any) -> int:
        return self._life.step(lambda: SimulatedBridge.ctrl_transfer(self, *arguments))

    def clear_halt(self, *arguments: Any) -> None:
        self._life.step(lambda: SimulatedBridge.clear_halt(self, *arguments))

    def attach_kernel_driver(self, *arguments: Any) -> None:
        if not self._life.dead:  # the kernel does not do it for a process that has gone
            super().attach_kernel_driver(*arguments)


class KilledUsbRig(UsbRig):
    """A driver that is killed at some call to libusb. refuses_reset: see SimulatedBridge."""

    refuses_reset = False

    def make_bridge(self, target: Target) -> SimulatedBridge:
        self.life = Lifeline()
        return _MortalBridge(
            self.life,
            target,
            packet_size=HIGH_SPEED,
            sleep=self.clock.sleep,
            kernel_driver=True,
            refuses_reset=self.refuses_reset,
        )

    def kernel_violation(self) -> str:
        """What is wrong with the kernel's side after the driver was closed, or empty."""
        self.camera.close()
        assert self.bridge is not None
        return "" if self.bridge.kernel_driver else "the kernel's driver is not attached"


class StubbornUsbRig(KilledUsbRig):
    """The same with a bridge that refuses reset recovery."""

    refuses_reset = True


class KilledSgRig(SgRig):
    """A driver that is killed at some SG_IO."""

    def make_node(self, target: Target) -> SimulatedSgNode:
        self.life = Lifeline()
        node = SimulatedSgNode(target, sleep=self.clock.sleep)
        ioctl = node.ioctl
        node.ioctl = lambda *arguments: self.life.step(lambda: ioctl(*arguments))  # type: ignore[method-assign]
        return node

    def kernel_violation(self) -> str:
        """What is wrong with the kernel's side after the driver was closed, or empty."""
        self.camera.close()
        assert self.node is not None
        return "the node is still open" if self.node.is_open() else ""


KILLED_RIGS: dict[str, type[KilledUsbRig | KilledSgRig]] = {
    "sg": KilledSgRig,
    "usb": KilledUsbRig,
    "usb, no reset": StubbornUsbRig,
}


def count_calls(rig: KilledUsbRig | KilledSgRig) -> int:
    """Calls to the kernel from opening to closing, with a capture between; leaves the driver closed."""
    rig.camera.close()
    rig.life.calls = 0
    camera = rig.open()
    camera.capture(SETTINGS)
    camera.close()
    return rig.life.calls


def kill_violation(rig: KilledUsbRig | KilledSgRig, call: int, *, after: bool) -> str:
    """What is wrong after a driver was killed at a call and the next one started, or empty. Leaves it closed."""
    rig.set_bus({})
    rig.life.calls, rig.life.dies_at, rig.life.after = 0, call, after
    try:
        camera = rig.open()
        camera.capture(SETTINGS)
        camera.close()
        return "the driver was not killed"
    except Killed:
        pass
    if isinstance(rig, KilledSgRig) and rig.node is not None:
        rig.node.close()  # the kernel closes the files of a process that ends
    rig.life.dies_at, rig.life.dead = -1, False
    rig.stops, start = 0, rig.clock()
    try:
        rig.camera = rig.open()
    except ScannerError as error:
        return f"the next start failed: {error}"
    parked = "" if rig.device.is_parked else "the laser is not off after the start"
    rig.stops = 1  # the stage is stopped by whoever opens it
    return parked or rig.rest_violation(start) or rig.next_capture_violation() or rig.kernel_violation()


When = Callable[["ServedDevice"], bool]


def never(_served: ServedDevice) -> bool:
    """Not now."""
    return False


class ServedDevice:
    """A device on a socket that can kill the process that drives it, before any of its commands.

    commands  number of commands so far; kills: whether to kill the victim, a process number, now.
    """

    def __init__(self) -> None:
        self.device = SimulatedDevice(Lens("MIDDLE", 14, PlateSensor()), load_profile(SIMULATED), monotonic)
        self.commands, self.victim = 0, 0
        self.kills: When = never
        self._listener = listen()
        self.port: int = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=serve, args=(self, self._listener))
        self._thread.start()

    def execute(self, cdb: bytes, data_out: bytes, data_in_length: int) -> Reply:
        """See Target."""
        if self.kills(self):
            os.kill(self.victim, signal.SIGKILL)
        self.commands += 1
        return self.device.execute(cdb, data_out, data_in_length)

    def close(self) -> None:
        """End the server."""
        with suppress(OSError):
            self._listener.shutdown(2)
        self._listener.close()
        self._thread.join()


def real_kill_violation(served: ServedDevice, when: When) -> str:
    """What is wrong after a process was killed in its capture and another driver started, or empty.

    A capture that ends before `when` says so gives "not killed".
    """
    served.commands = 0
    with subprocess.Popen([sys.executable, "-c", CHILD, str(served.port), SIMULATED]) as child:
        served.victim, served.kills = child.pid, when
        try:
            status = child.wait(STARTED_S)
        except subprocess.TimeoutExpired:
            child.kill()
            return "the process neither captured nor died"
    served.kills = never
    if status != KILLED_STATUS:
        return NOT_KILLED if status == 0 else f"the process ended with {status}"
    was_set = served.device.parameters.laser_power
    config = {"driver": "vivid900", "profile": SIMULATED, "transport": {"kind": "socket", "port": served.port}}
    try:
        connect(config).close()
    except ScannerError as error:
        return f"the next start failed: {error}"
    return "" if served.device.is_parked else f"the laser's power is left at {was_set}"
