"""The range image as the scanner sends it ("pitch" in its development kit).

While the stripe passes, the CCD is read frame after frame. For every sample the scanner adds up the brightness x, and x
times the number i of the frame; the quotient Σ(i·x)/Σx is the frame at which the middle of the stripe lay on the
sample: the temporal barycentre (US 6,151,118; hardware manual p. 57). Some 3.6 MB for a FINE shot with colour
(p. 59) leave nine bytes a sample: two sums of 32 bits and one brightness of eight fit. How the vendor packs them is not
known; the profile defines it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.scanner import SettingsError
from drivers.vivid900.errors import BadReply
from drivers.vivid900.lenses import Mode
from drivers.vivid900.profile import PitchEncoding, Profile
from restore.scan import Bytes, Floats


@dataclass(frozen=True, eq=False)
class Pitch:
    """A range image before triangulation.

    frames     (rows, cols) float64 frame at which the stripe's middle crossed the sample, NaN where not measured.
    intensity  (rows, cols) uint8 brightest value that the sample had, 255 where the CCD was saturated.
    shot       which shot since power-on it is of.
    """

    frames: Floats
    intensity: Bytes
    shot: int = 0


@dataclass(frozen=True, eq=False)
class Sums:
    """Accumulated sums per sample, each (rows, cols): Σx and Σ(i·x) uint32, brightest x uint8."""

    sum: NDArray[np.uint32]
    moment: NDArray[np.uint32]
    intensity: Bytes


def pitch_length(profile: Profile, mode: Mode) -> int:
    """Bytes of the range image of a mode, header and all."""
    return profile.blocks.pitch.length + mode.rows * mode.cols * _pixel(profile.pitch).itemsize


def build_pitch(profile: Profile, sums: Sums, shot: int) -> bytes:
    """The range image in bytes. Raises SettingsError when a sum does not fit into its bytes."""
    record = np.empty(sums.sum.shape, _pixel(profile.pitch))
    for name in ("sum", "moment", "intensity"):
        values = getattr(sums, name)
        if values.size and values.max() > np.iinfo(record[name].dtype).max:
            raise SettingsError(f"a {name} of {values.max()} does not fit into the profile's pixel")
        record[name] = values
    rows, cols = sums.sum.shape
    return profile.blocks.pitch.build({"shot": shot, "rows": rows, "cols": cols}, record.tobytes())


def parse_pitch(profile: Profile, mode: Mode, data: bytes) -> Pitch:
    """Read the range image of a mode.

    A sample without light, or whose barycentre lies outside the sweep, is NaN. Raises BadReply when the length, the
    header or the checksum is wrong.
    """
    pixel, header = _pixel(profile.pitch), profile.blocks.pitch.length
    values = profile.blocks.pitch.parse(data, payload=mode.rows * mode.cols * pixel.itemsize)
    if (values["rows"], values["cols"]) != (mode.rows, mode.cols):
        raise BadReply(f"a range image of {values['cols']}×{values['rows']} samples came, not {mode.cols}×{mode.rows}")
    record = np.frombuffer(data, pixel, offset=header).reshape(mode.rows, mode.cols)
    total, moment = record["sum"].astype(float), record["moment"].astype(float)
    seen = (total > 0) & (moment <= total * (mode.rows + mode.frames))
    frames = np.divide(moment, total, out=np.full(total.shape, np.nan), where=seen)
    return Pitch(frames, np.ascontiguousarray(record["intensity"], np.uint8), values["shot"])


def _pixel(encoding: PitchEncoding) -> np.dtype[np.void]:
    order = ">" if encoding.order == "big" else "<"
    return np.dtype([(name, order + size) for name, size in encoding.pixel])
