"""Opens the Vivid 900 that a station's `[scanner]` table describes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import IO, Any

from drivers.scanner import SettingsError
from drivers.scsi.transport import DEFAULT_TIMEOUT_S, Reply, Transport
from drivers.vivid900 import config as settings_table
from drivers.vivid900.capture.camera import CalibrationOf, Vivid900
from drivers.vivid900.config import Replay, Sg, Socket, Usb
from drivers.vivid900.geometry.calibration import Calibration, nominal, read_calibration
from drivers.vivid900.geometry.lenses import LENSES
from drivers.vivid900.link import Link
from drivers.vivid900.profile.commands import Status
from drivers.vivid900.profile.profile import Profile, load_profile

NOT_REPORTED = {"", "0"}  # a lens, a serial number


def connect(config: Mapping[str, Any]) -> Vivid900:
    """Open the scanner that the table describes.

    Raises SettingsError before anything is sent, then as Vivid900 does.
    """
    wanted = settings_table.read(config)
    known = calibrations(wanted.calibration, lens=wanted.lens)
    link, profile = open_link(config)
    return Vivid900(link, profile, known)


def open_link(config: Mapping[str, Any]) -> tuple[Link, Profile]:
    """Return the link and the profile that the table names.

    Nothing is sent. Raises SettingsError, TransportError.
    """
    wanted = settings_table.read(config)
    profile, transport = load_profile(wanted.profile), open_transport(wanted.transport)
    if wanted.record is not None:
        transport = _recorded(transport, wanted.record)
    return Link(transport), profile


def open_transport(settings: Sg | Usb | Socket | Replay) -> Transport:
    """Open the transport to a scanner; nothing is sent. Raises TransportError."""
    return _OPENERS[settings.kind](settings)


def calibrations(path: Path | None, *, lens: str | None = None) -> CalibrationOf:
    """Return a function that gives the calibration of the mounted lens.

    It is the file's, or the manual's figures without a file.
    lens: name of the mounted lens for scanners that do not report it.
    Raises SettingsError when the file cannot be read; the function raises it for another lens or body.
    """
    if path is None:
        return partial(_nominal, lens=lens)
    calibration = read_calibration(path)

    def calibration_of(status: Status) -> Calibration:
        mounted = {"lens": status.lens, "lens_serial": str(status.lens_serial), "body": str(status.body_serial)}
        for what, found in mounted.items():
            wanted = getattr(calibration, what)
            if wanted and found not in NOT_REPORTED and wanted != found:
                raise SettingsError(
                    f"{path} is the calibration of {what.replace('_', ' ')} {wanted}, and the scanner has {found}",
                    "name the calibration of this lens on this body, or leave it out for the manual's figures",
                )
        return calibration

    return calibration_of


def _nominal(status: Status, *, lens: str | None) -> Calibration:
    mounted = status.lens or lens
    if mounted is None:
        hint = 'write lens = "TELE", "MIDDLE" or "WIDE" into [scanner], or name its calibration'
        raise SettingsError("the scanner does not report which lens is mounted", hint)
    return nominal(LENSES[mounted], body=str(status.body_serial), lens_serial=str(status.lens_serial))


# The library of a transport is imported only when the transport is used.
def _sg(settings: Sg) -> Transport:
    from drivers.scsi.sg import SgDevice

    return SgDevice(settings.device)


def _usb(settings: Usb) -> Transport:
    from drivers.scsi.bridges import device_node
    from drivers.scsi.usb import UsbBulkOnly, find_device

    device = find_device(settings.vendor, settings.product)
    return UsbBulkOnly(device, target=settings.target, node=device_node(device))


def _socket(settings: Socket) -> Transport:
    from drivers.scsi.tcp import TcpDevice

    return TcpDevice(settings.host, settings.port)


def _replay(settings: Replay) -> Transport:
    from drivers.scsi.replay import load_replay

    return load_replay(settings.file)


_OPENERS: dict[str, Callable[[Any], Transport]] = {"sg": _sg, "usb": _usb, "socket": _socket, "replay": _replay}


class _FileRecorder:
    """A recorder that owns its file and closes it with the transport."""

    def __init__(self, recorder: Transport, file: IO[str]) -> None:
        self.max_transfer, self._recorder, self._file = recorder.max_transfer, recorder, file

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        return self._recorder.execute(cdb, data_out, data_in_length, timeout)

    def close(self) -> None:
        try:
            self._recorder.close()
        finally:
            with suppress(OSError):
                self._file.close()


def _recorded(transport: Transport, path: Path) -> Transport:
    from drivers.scsi.replay import Recorder

    try:
        file = path.open("x", encoding="utf-8")
        return _FileRecorder(Recorder(transport, file), file)
    except OSError as error:
        transport.close()
        raise SettingsError(
            f"cannot record to {path}: {error.strerror}", "name a file that is not there yet"
        ) from error
