"""The calibration of one body with one lens, and its file.

A lens is adjusted to one body (VIVID 910 hardware manual p. 27), so a calibration holds for the two together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from drivers.scanner import SettingsError
from drivers.vivid900.geometry.lenses import BASELINE_MM, Lens
from restore.files import read_toml
from restore.vivid import TEXTURE_COLS, TEXTURE_ROWS

FORMAT = 1
REPLACE_CALIBRATION = "calibrate again with `planish calibrate`, or leave the file out for the manual's figures"
MAX_SWEEP_TANGENT = (
    1.0  # tangent of the steepest stripe plane of any lens (WIDE at its nearest distance), with a margin
)

Finite = Annotated[float, Field(allow_inf_nan=False)]
Serial = Annotated[str, Field(max_length=64)]


@dataclass(frozen=True)
class Measurement:
    """Record how a calibration was measured.

    date         of the day, as 2026-01-31.
    captures     of boards and plates.
    lines_rms    rms residual of the samples from their planes, CCD lines.
    expected_mm  largest error of a point to expect over the field, one standard deviation.
    markers_px   rms reprojection error of the markers, pixels; None without markers.
    expected_length  largest error of a length to expect, a fraction of it, one standard deviation; None where it was
                 not recorded.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")

    date: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")]
    captures: Annotated[int, Field(ge=1)]
    lines_rms: Annotated[Finite, Field(ge=0)]
    expected_mm: Annotated[Finite, Field(ge=0)]
    markers_px: Annotated[Finite, Field(ge=0)] | None = None
    expected_length: Annotated[Finite, Field(ge=0)] | None = None


@dataclass(frozen=True)
class Calibration:
    """Geometry of one body and one lens.

    The geometry has no defaults: a truncated file is refused.

    body, lens_serial  serial numbers, empty where they are not known.
    baseline_mm        from the lens centre down to the axis of the galvano mirror.
    focal_px           focal length in texture pixels; the pixels are square.
    centre_px          texture pixel (x, y) on the optical axis.
    pupil_mm           distance of the lens centre behind the front of the lens.
    distortion         (k1, k2): a direction of tangents t is seen at t·(1 + k1·|t|² + k2·|t|⁴), the radial terms of
                       Brown (1966).
    plane              (p0, p1, p2, p3): a mirror sent to the tangent s stands at s + p0 + p1·s + p2·s² + p3·s³.
    tilt, bow          the stripe seen at the tangent u to the right is higher by tilt·u + bow·u², in tangents.
    measured           how; None for the manual's figures, and in files that were written before it was recorded.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")

    body: Serial
    lens: Literal["TELE", "MIDDLE", "WIDE"]
    lens_serial: Serial
    baseline_mm: Annotated[Finite, Field(ge=200, le=300)]
    focal_px: Annotated[Finite, Field(ge=500, le=5000)]
    centre_px: tuple[Finite, Finite]
    pupil_mm: Annotated[Finite, Field(ge=-50, le=100)]
    distortion: tuple[Finite, Finite]
    plane: tuple[Finite, Finite, Finite, Finite]
    tilt: Finite
    bow: Finite
    measured: Measurement | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the calibration as JSON values, for the provenance of a scan.

        `calibration_of` reads them back.
        """
        fields = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}
        return {name: value for name, value in fields.items() if name != "measured" or value is not None}


def nominal(lens: Lens, *, body: str = "", lens_serial: str = "") -> Calibration:
    """The manual's figures for every body: a linear sweep and a lens without distortion."""
    return _ADAPTER.validate_python(
        {
            "body": body,
            "lens": lens.name,
            "lens_serial": lens_serial,
            "baseline_mm": BASELINE_MM,
            "focal_px": lens.focal_px,
            "centre_px": ((TEXTURE_COLS - 1) / 2, (TEXTURE_ROWS - 1) / 2),
            "pupil_mm": lens.pupil_mm,
            "distortion": (0.0, 0.0),
            "plane": (0.0, 0.0, 0.0, 0.0),
            "tilt": 0.0,
            "bow": 0.0,
        }
    )


def read_calibration(path: Path) -> Calibration:
    """Read a calibration file.

    Raises SettingsError when it cannot be read, is damaged, or has impossible values.
    """
    try:
        table = read_toml(path)
    except OSError as error:
        hint = f"check the path, or {REPLACE_CALIBRATION}"
        raise SettingsError(f"cannot read the calibration {path}: {error.strerror}", hint) from error
    except ValueError as error:  # also TOMLDecodeError, UnicodeDecodeError
        raise SettingsError(f"{path} is not a calibration: {error}", REPLACE_CALIBRATION) from error
    if table.pop("format", None) != FORMAT:
        raise SettingsError(f"{path} is not a calibration: it lacks the line `format = {FORMAT}`", REPLACE_CALIBRATION)
    return calibration_of(table, str(path))


def calibration_of(table: Mapping[str, Any], where: str) -> Calibration:
    """Return the calibration of a table in a file or a scan's provenance.

    where: name of the table in messages.
    Raises SettingsError for a missing, unknown or impossible value.
    """
    try:
        calibration = _ADAPTER.validate_python(table)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ": ".join([where, *map(str, first["loc"])])
        raise SettingsError(f"{key}: {first['msg']}, not {first['input']!r}", REPLACE_CALIBRATION) from error
    _check_one_to_one(calibration, where)
    return calibration


def encode_calibration(calibration: Calibration, *, comments: Sequence[str] = ()) -> str:
    """Return the text of a calibration file, under lines of comment.

    `read_calibration` gives the calibration back exactly.
    """
    lines = [f"# {comment}".rstrip() for comment in ("Planish: calibration of a Vivid 900", *comments)]
    lines += ["", f"format = {FORMAT}"]
    table = calibration.as_json()
    measured = table.pop("measured", {})
    lines += [f"{name} = {_toml(value)}" for name, value in table.items()]
    lines += ["", "[measured]"] if measured else []
    lines += [f"{name} = {_toml(value)}" for name, value in measured.items() if value is not None]
    return "\n".join(lines) + "\n"


_ADAPTER: TypeAdapter[Calibration] = TypeAdapter(Calibration)


def _check_one_to_one(calibration: Calibration, where: str) -> None:
    """Check that pixels and lines of sight correspond one to one.

    So must stripe planes and positions of the mirror.
    """
    corner = np.hypot(TEXTURE_COLS, TEXTURE_ROWS) / calibration.focal_px  # twice as far out as any pixel
    radius = np.linspace(0, corner, 65)
    k1, k2 = calibration.distortion
    if (1 + 3 * k1 * radius**2 + 5 * k2 * radius**4 <= 0).any():
        raise SettingsError(f"{where}: distortion: {calibration.distortion} folds the image over", REPLACE_CALIBRATION)
    s = np.linspace(-MAX_SWEEP_TANGENT, MAX_SWEEP_TANGENT, 65)
    _, p1, p2, p3 = calibration.plane
    if (1 + p1 + 2 * p2 * s + 3 * p3 * s**2 <= 0).any():
        raise SettingsError(f"{where}: plane: {calibration.plane} makes the stripe turn back", REPLACE_CALIBRATION)


def _toml(value: str | float | list[float]) -> str:
    if isinstance(value, str):
        quoted = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(f"\\u{ord(c):04x}" if ord(c) < 32 or ord(c) == 127 else c for c in quoted) + '"'
    return f"[{', '.join(map(repr, value))}]" if isinstance(value, list) else repr(value)
