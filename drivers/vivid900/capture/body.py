"""Operations of a Vivid 900: wait, set, focus, capture, laser off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from drivers.scanner import Progress, ScannerError
from drivers.scsi.errors import SCAN_AGAIN, BadReply
from drivers.vivid900.capture.colour import ColourImage, colour_length, parse_colour
from drivers.vivid900.capture.pitch import Pitch, parse_pitch, pitch_length
from drivers.vivid900.errors import DeadlineExceeded, Interrupted, NotReady, StillBusy
from drivers.vivid900.faults import panel_error
from drivers.vivid900.geometry.lenses import FAST, FINE, Mode
from drivers.vivid900.link import Link, pauses
from drivers.vivid900.profile import commands
from drivers.vivid900.profile.commands import (
    AUTO_COLOUR,
    AUTO_THRESHOLD,
    RANGES,
    Command,
    Focus,
    Parameters,
    ShotMode,
    State,
    Status,
)
from drivers.vivid900.profile.profile import Profile
from drivers.vivid900.profile.template import Template

# Expected duration of an operation, and its time-out, seconds.
WARM_UP_S = (10.0, 30.0)  # the self test (manual p. 13)
SHOT_S = (3.5, 15.0)  # a FINE shot takes 2.5 s, its colours 0.5 s (p. 59), the motor's turn before it a second or two
FOCUS_S = (1.5, 10.0)
PARK_ATTEMPTS = 5
MAX_READINGS = 4  # of a block without a checksum: a status may change once between two of them
BARRIER = "AF/AE ERROR LASER BARRIER MAY BE CLOSED"
CHOSEN_BY_SCANNER = {"threshold": AUTO_THRESHOLD, "colour": AUTO_COLOUR}
RANGE_MODES: dict[ShotMode, Mode] = {ShotMode.FINE_COLOUR: FINE, ShotMode.FAST_COLOUR: FAST}


@dataclass(frozen=True, eq=False)
class Shot:
    """Data of one release: range image and colour image, None where its mode has none."""

    pitch: Pitch | None
    colour: ColourImage | None


@dataclass(frozen=True)
class Body:
    """Scanner behind a link whose profile fits it.

    `progress` is called at every step and may raise to cancel.
    """

    link: Link
    profile: Profile
    progress: Progress

    def status(self) -> Status:
        """Read the status block, or else the state that TEST UNIT READY reports."""
        if "status" not in self.profile.commands:
            return Status(self.link.readiness())
        return commands.parse_status(
            self.profile, self._block(self.profile.blocks.status, commands.status(self.profile))
        )

    def wait_ready(self) -> Status:
        """Wait for the end of the self test.

        Raises BarrierClosed at once, NotReady at the time-out.
        """
        status = self._wait("warm-up", lambda status: status.state not in ("warming-up", "busy"), WARM_UP_S)
        if status.state == "barrier-closed":
            raise panel_error(BARRIER)
        return status

    def read_parameters(self) -> Parameters:
        """Read the parameter block."""
        return commands.parse_parameters(self.profile, self._parameter_block())

    def set_parameters(self, parameters: Parameters) -> None:
        """Change fields of the parameter block, write it and read it back.

        Bytes without a field are written as they were read: their meaning is unknown. Raises BadReply when the block
        read back differs.
        """
        self._write_block(commands.build_parameters(self.profile, parameters, base=self._parameter_block()))

    def autofocus(self, kind: Focus) -> Parameters:
        """Focus and return the parameters that autofocus set.

        These are the distance, and the laser power of the active kind. Raises PanelError, BarrierClosed, Interrupted
        when the scanner has not focused.
        """
        self.progress("focus", 0.0)
        before = self.status().focused
        self.link.run(commands.autofocus(self.profile, kind))
        status = self._wait("focus", lambda status: status.state != "busy", FOCUS_S)
        self._raise_panel(status)
        if "focused" in self.profile.blocks.status.fields and status.focused != before + 1:
            raise Interrupted("the scanner has not focused", SCAN_AGAIN)
        self.progress("focus", 1.0)
        found = self.read_parameters()
        if self.read_parameters() != found:  # a repeated old answer cannot be detected otherwise
            raise BadReply("the scanner reports two distances for one autofocus")
        return found

    def shoot(self, parameters: Parameters) -> Shot:
        """Write the parameters, release, wait, and read the images of the shot.

        Raises Interrupted when the scanner has the data of another shot or of none, or was set otherwise meanwhile.
        """
        self.set_parameters(parameters)
        before = self.status().shot
        self.link.run(commands.release(self.profile, parameters))
        status = self._wait("scan", lambda status: status.state != "busy", SHOT_S)
        self._raise_panel(status)
        counts = "shot" in self.profile.blocks.status.fields
        if status.state != self._done or (counts and status.shot != before + 1):
            raise Interrupted("the scanner has lost the capture", SCAN_AGAIN)
        mode = parameters.mode
        pitch = self._pitch(RANGE_MODES[mode]) if mode.has_range else None
        with_colour = not mode.has_range or (parameters.auto_read == 0 and "read_colour" in self.profile.commands)
        shot = Shot(pitch, self._colour(mode) if with_colour else None)
        numbers = {part.shot for part in (shot.pitch, shot.colour) if part is not None} - {None}
        if len(numbers | ({status.shot} if counts else set())) > 1:
            raise Interrupted("the scanner sent an image of another capture", SCAN_AGAIN)
        if changed := self._changed(parameters):
            names = ", ".join(name.replace("_", " ") for name in changed)
            raise Interrupted(f"{names} was changed at the scanner during the capture", SCAN_AGAIN)
        return shot

    def _changed(self, parameters: Parameters) -> list[str]:
        """Return the names of the parameters that the scanner has changed.

        They differ from those that were set, such as the laser power. Parameters that the scanner was to choose are
        left out, because it may show them as chosen.
        """
        now, fields = self.read_parameters(), self.profile.blocks.parameters.fields
        chosen = {name for name, auto in CHOSEN_BY_SCANNER.items() if getattr(parameters, name) == auto}
        names = [name for name in RANGES if name in fields and name not in chosen]
        return [name for name in names if getattr(now, name) != getattr(parameters, name)]

    @property
    def _done(self) -> State:
        """Return the state after a shot.

        Some scanners do not distinguish data from ready.
        """
        return "data" if "data" in self.profile.states and "status" in self.profile.commands else "ready"

    def laser_off(self) -> None:
        """Set the laser power to 0, and no other parameter, in any state.

        Waits for the end of a shot in progress; a scanner that is not ready does not shoot. Raises the last error when
        all attempts fail.
        """
        for last, pause in zip(reversed(range(PARK_ATTEMPTS)), pauses(), strict=False):
            try:
                self._write_block(commands.without_laser(self.profile, self._parameter_block()))
                return
            except NotReady:
                pass
            except DeadlineExceeded:
                raise
            except ScannerError:
                if not last:
                    raise
            self.link.sleep(pause)

    def _parameter_block(self) -> bytes:
        return self._block(self.profile.blocks.parameters, commands.read_parameters(self.profile))

    def _block(self, block: Template, command: Command) -> bytes:
        """Read a block; without a checksum, until two readings agree.

        Raises BadReply.
        """
        data = self.link.run(command)
        if block.is_checked:
            return data
        for _ in range(MAX_READINGS - 1):
            before, data = data, self.link.run(command)
            if data == before:
                return data
        raise BadReply(f"{command.name}: the scanner answers differently each time")

    def _image(self, block: Template, read: Callable[[int, int], Command], length: int) -> bytes:
        """Read an image; without a checksum twice, where the scanner allows.

        Raises BadReply when the two readings differ.
        """
        data = self.link.read(read, length)
        if not block.is_checked and not self.profile.reads_once and self.link.read(read, length) != data:
            raise BadReply("an image was damaged on its way: read twice, it differs")
        return data

    def _write_block(self, block: bytes) -> None:
        self.link.run(commands.write_parameters(self.profile, block))
        fields = self.profile.blocks.parameters
        if fields.parse(self._parameter_block()) != fields.parse(block):
            raise BadReply("the scanner did not take its parameters")

    def _pitch(self, mode: Mode) -> Pitch:
        read = partial(commands.read_pitch, self.profile)
        return parse_pitch(
            self.profile, mode, self._image(self.profile.blocks.pitch, read, pitch_length(self.profile, mode))
        )

    def _colour(self, mode: ShotMode) -> ColourImage:
        read = partial(commands.read_colour, self.profile, mode)
        return parse_colour(
            self.profile, mode, self._image(self.profile.blocks.colour, read, colour_length(self.profile, mode))
        )

    def _wait(self, step: str, done: Callable[[Status], bool], seconds: tuple[float, float]) -> Status:
        """Poll the status until `done`.

        Raises StillBusy at the time-out, NotReady when it is still warming up.
        """
        start, (expected, limit) = self.link.clock(), seconds
        for pause in pauses():
            status = self.status()
            waited = self.link.clock() - start
            if done(status):
                return status
            if waited > limit:
                break
            self.progress(step, min(waited / expected, 0.99))
            self.link.sleep(pause)
        if status.state == "warming-up":
            raise NotReady(f"the scanner has been warming up for {limit:g} s", "look at its panel")
        raise StillBusy(f"the scanner has been busy for {limit:g} s", "look at its panel; switch it off and on")

    def _raise_panel(self, status: Status) -> None:
        if status.state == "barrier-closed":
            raise panel_error(BARRIER)
        if status.panel:
            raise panel_error(status.panel)
        if "status" in self.profile.commands and "panel" not in self.profile.blocks.status.fields:
            self.link.readiness()  # raises the states that only sense data report
