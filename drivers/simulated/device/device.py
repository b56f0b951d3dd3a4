"""A simulated Vivid 900 that answers command bytes.

Everything above it is the real driver. Timing and behaviour follow the VIVID 910 hardware manual (9222-1888-19); the
pages are given. The bytes are those of a command profile, by default Planish's own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from drivers.scanner import ScannerError, TransportError
from drivers.scsi import commands as scsi
from drivers.scsi.commands import Identity
from drivers.scsi.sense import Key, Sense
from drivers.scsi.transport import BUSY, CHECK_CONDITION, GOOD, Reply
from drivers.simulated.device.event_log import Log
from drivers.simulated.imaging.exposure import exposure_for_paper
from drivers.simulated.imaging.sensor import Sensor
from drivers.simulated.imaging.shot_data import ShotData, read_out
from drivers.vivid900.capture.body import RANGE_MODES
from drivers.vivid900.profile import commands
from drivers.vivid900.profile.commands import RANGES, Parameters, State, Status
from drivers.vivid900.profile.profile import Profile
from drivers.vivid900.settings import MAX_DISTANCE_MM, MIN_DISTANCE_MM

SELF_TEST_S = 10.0  # after power-on and after a change of the lens (p. 13, p. 27)
MOTOR_S = 1.0  # between FINE and FAST a motor turns first (p. 31); how long is not said
COLOUR_S = 0.5  # p. 59
PASSIVE_AF_S, ACTIVE_AF_S = 1.0, 1.5  # not in the manual
AF_POWER = 30  # the laser that autofocus looks with; not in the manual

LOW_CONTRAST, OUT_OF_RANGE = "AF ERROR LOW CONTRAST", "ERROR OUT OF DISTANCE RANGE (0.5-2.5 m)"
POWER_ON, LENS_CHANGED = Sense(Key.UNIT_ATTENTION, 0x29), Sense(Key.UNIT_ATTENTION, 0x28)
WARMING_UP, BARRIER_CLOSED = Sense(Key.NOT_READY, 0x04, 0x01), Sense(Key.NOT_READY, 0x80, 0x01)
NO_SUCH_COMMAND, BAD_FIELD = Sense(Key.ILLEGAL_REQUEST, 0x20), Sense(Key.ILLEGAL_REQUEST, 0x24)
BAD_PARAMETER, NO_DATA = Sense(Key.ILLEGAL_REQUEST, 0x26), Sense(Key.ILLEGAL_REQUEST, 0x2C)


@dataclass(frozen=True, eq=False)
class Lens:
    """A mounted lens: name, serial number, and the sensor behind it."""

    name: Literal["TELE", "MIDDLE", "WIDE"]
    serial: int
    sensor: Sensor


class _Refused(Exception):
    """Ends a command with CHECK CONDITION."""

    def __init__(self, sense: Sense) -> None:
        self.sense = sense


class _NotNow(Exception):
    """Ends a command with BUSY."""


class SimulatedDevice:
    """The device's side of the bus, on at first and past its self test.

    clock    its time; busy times end when the clock says so.
    log      events, and the times when the laser was on.
    barrier  whether the laser barrier covers the laser window.
    fails    panel message of the next operation, empty for none.
    parked   called when the laser power was set to 0: the page may be moved then.
    """

    def __init__(
        self,
        lens: Lens,
        profile: Profile,
        clock: Callable[[], float],
        *,
        body_serial: int = 9000001,
        parked: Callable[[], None] | None = None,
    ) -> None:
        self.lens, self.profile, self.body_serial = lens, profile, body_serial
        self.log, self.barrier, self.fails, self._parked = Log(clock), False, "", parked or _nothing
        self.parameters, self.panel, self.shot, self.focused = Parameters(), "", 0, 0
        self.parameter_block = commands.build_parameters(profile, self.parameters)
        self._clock, self._on, self._ready_at = clock, True, clock()
        self._attentions, self._sense = [POWER_ON], Sense(Key.NO_SENSE)
        self._busy_until, self._ending, self._record = clock(), _nothing, ShotData()
        self._read_so_far: dict[str, int] = {}

    @property
    def state(self) -> State | Literal["off"]:
        """State of the device."""
        now = self._clock()
        if not self._on:
            return "off"
        if now < self._ready_at:
            return "warming-up"
        if now < self._busy_until:
            return "busy"
        self._end_operation()
        if self.barrier:
            return "barrier-closed"
        return "data" if self._record.shot else "ready"

    @property
    def is_parked(self) -> bool:
        """Whether the laser is off and cannot come on with the next shot."""
        return not self.log.laser_is_on and self.parameters.laser_power == 0

    def power_off(self) -> None:
        """Switch it off: all data is lost."""
        self._on = False
        self._forget("power off")

    def power_on(self) -> None:
        """Switch it on: it runs its self test, and reports the power-on."""
        self._on, self._ready_at, self.shot, self.focused = True, self._clock() + SELF_TEST_S, 0, 0
        self._forget("power on")
        self._attentions = [POWER_ON]

    def reset(self) -> None:
        """A reset of the bus: all data is lost, without a self test."""
        self._forget("reset")
        self._attentions = [POWER_ON]

    def change_lens(self, lens: Lens) -> None:
        """Mount another lens.

        Data that was not read is lost, and the lens initialises again (p. 27).
        """
        self.lens, self._ready_at = lens, self._clock() + SELF_TEST_S
        self._forget("lens")
        if LENS_CHANGED not in self._attentions:  # it happened, however often
            self._attentions.append(LENS_CHANGED)

    def execute(self, cdb: bytes, data_out: bytes, data_in_length: int) -> Reply:
        """See Target. Raises TransportError when it is off."""
        if not self._on:
            raise TransportError("no device answers", "switch the scanner on")
        known = commands.parse_command(self.profile, cdb, data_out)
        self.log.add("command", known[0] if known else cdb.hex(" "))
        try:
            if cdb and cdb[0] in scsi.STANDARD:
                return Reply(GOOD, self._standard(cdb[0])[:data_in_length])
            if self._attentions:
                raise _Refused(self._attentions.pop(0))
            if known is None:
                opcodes = {command.opcode for command in self.profile.commands.values()}
                raise _Refused(BAD_FIELD if cdb and cdb[0] in opcodes else NO_SUCH_COMMAND)
            name, values = known
            return Reply(GOOD, getattr(self, "_" + name)(data_out, **values)[:data_in_length])
        except _NotNow:
            return Reply(BUSY)
        except _Refused as refusal:
            self._sense = refusal.sense
            return Reply(CHECK_CONDITION)

    def _standard(self, opcode: int) -> bytes:
        if opcode == scsi.INQUIRY:
            firmware = self.profile.firmware
            revision = firmware.revisions[0].replace("*", "9").replace("?", "9")
            return Identity(scsi.PROCESSOR_TYPE, firmware.vendor, firmware.product, revision).build()
        if opcode == scsi.REQUEST_SENSE:
            sense, self._sense = self._sense, Sense(Key.NO_SENSE)
            return sense.build()
        if self._attentions:
            raise _Refused(self._attentions.pop(0))
        self._require_free()
        if self.barrier:
            raise _Refused(BARRIER_CLOSED)
        if self.panel and "panel" not in self.profile.blocks.status.fields:  # no other sign
            panel, self.panel = self.panel, ""
            raise _Refused(self._sense_of(panel))
        return b""

    def _sense_of(self, panel: str) -> Sense:
        """Return sense data for a message of the panel: the profile's, or a hardware fault."""
        codes = [code for code, text in self.profile.panel_by_sense.items() if text == panel]
        return Sense(Key.HARDWARE_ERROR, *(codes[0] if codes else (0x44, 0x00)))

    def _status(self, _data: bytes, **_values: int) -> bytes:
        state = self.state
        assert state != "off"  # execute() raises before
        if state not in self.profile.states:  # reported by sense data, or as ready
            self._require_free()
            state = "ready"
        numbers = {
            "shot": self.shot,
            "focused": self.focused,
            "lens_serial": self.lens.serial,
            "body_serial": self.body_serial,
        }
        return commands.build_status(self.profile, Status(state, self.lens.name, panel=self.panel, **numbers))

    def _read_parameters(self, _data: bytes, **_values: int) -> bytes:
        self._require_free()
        return commands.build_parameters(self.profile, self.parameters, base=self.parameter_block)

    def _write_parameters(self, data: bytes, **_values: int) -> bytes:
        self._require_free()
        was_on = self.parameters.laser_power > 0
        try:
            self._take(self.profile.blocks.parameters.parse(data))
        except ScannerError as error:
            raise _Refused(BAD_PARAMETER) from error
        self.parameter_block = data
        self.log.add("parameters", f"laser power {self.parameters.laser_power}")
        if was_on and self.parameters.laser_power == 0:
            self._parked()
        return b""

    def _take(self, values: Mapping[str, int]) -> None:
        """Take over the parameters that a block or a release has.

        Raises BadReply for values out of range.
        """
        sent = commands.parameters_of(self.profile, values)
        self.parameters = replace(self.parameters, **{name: getattr(sent, name) for name in RANGES if name in values})

    def _passive_autofocus(self, _data: bytes) -> bytes:
        def focus() -> None:
            self.panel = self.panel or ("" if self.lens.sensor.contrast else LOW_CONTRAST)
            self._take_distance()

        self._begin("autofocus", PASSIVE_AF_S, focus)
        self.focused += 1
        return b""

    def _active_autofocus(self, _data: bytes) -> bytes:
        def focus() -> None:
            self._take_distance()
            if not self.panel:
                power, gain = exposure_for_paper(self.parameters.distance_mm)
                self.parameters = replace(self.parameters, laser_power=power, gain=gain)

        self._begin("autofocus", ACTIVE_AF_S, focus)
        self.focused += 1
        self.log.laser_on(self._clock(), ACTIVE_AF_S, AF_POWER)
        return b""

    def _release(self, _data: bytes, **values: int) -> bytes:
        self._take(values)
        parameters, seconds, motor = self.parameters, COLOUR_S, 0.0
        if parameters.mode.has_range:
            turns = self._record.swept not in (None, parameters.mode)
            motor = MOTOR_S if turns else 0.0
            seconds = motor + RANGE_MODES[parameters.mode].seconds + (0 if parameters.auto_read else COLOUR_S)
        swept = parameters.mode if parameters.mode.has_range else self._record.swept
        shot = self.shot + 1

        def expose() -> None:
            if not self.panel:
                self._record = read_out(self.lens.sensor, self.profile, parameters, shot, swept)

        self._begin("release", seconds, expose)
        self.shot, self._record, self._read_so_far = shot, ShotData(swept=swept), {}
        if parameters.mode.has_range:
            self.log.laser_on(self._clock() + motor, RANGE_MODES[parameters.mode].seconds, parameters.laser_power)
        return b""

    def _read_pitch(self, _data: bytes, **span: int) -> bytes:
        self._require_free()
        return self._part("pitch", self._record.pitch, **span)

    def _read_colour(self, _data: bytes, *, kind: int | None = None, **span: int) -> bytes:
        self._require_free()
        if self._record.mode is not None and kind is not None:
            taken = commands.read_colour(self.profile, self._record.mode, 0, 0).values["kind"]
            if self._record.colour and kind != taken:
                raise _Refused(BAD_FIELD)
        return self._part("colour", self._record.colour, **span)

    def _part(self, image: str, block: bytes, *, offset: int | None = None, length: int | None = None) -> bytes:
        """Return an image's bytes from an offset; without one, the next, then the first again."""
        if not block:
            raise _Refused(NO_DATA)
        start = self._read_so_far.get(image, 0) % len(block) if offset is None else offset
        end = len(block) if length is None else start + length
        if end > len(block):
            raise _Refused(BAD_FIELD)
        self._read_so_far[image] = end
        return block[start:end]

    def _begin(self, what: str, seconds: float, ending: Callable[[], None]) -> None:
        """Start an operation that needs the laser's path free.

        `ending` does its work when the time is over.
        """
        self._require_free()
        if self.barrier:
            raise _Refused(BARRIER_CLOSED)
        self.log.add(what)
        self.panel, self.fails = self.fails, ""
        self._busy_until, self._ending = self._clock() + seconds, ending

    def _end_operation(self) -> None:
        ending, self._ending = self._ending, _nothing
        ending()

    def _take_distance(self) -> None:
        distance = self.lens.sensor.distance_mm
        if not MIN_DISTANCE_MM <= distance <= MAX_DISTANCE_MM:
            self.panel = self.panel or OUT_OF_RANGE
        if not self.panel:
            self.parameters = replace(self.parameters, distance_mm=round(distance))

    def _require_free(self) -> None:
        if self.state == "warming-up":
            raise _Refused(WARMING_UP)
        if self.state == "busy":
            raise _NotNow

    def _forget(self, why: str) -> None:
        self.log.add(why)
        self.log.laser_off()
        self.parameters, self.panel, self._record = Parameters(), "", ShotData()
        self._busy_until, self._ending = self._clock(), _nothing


def _nothing() -> None:
    """Do nothing at the end of an operation."""
