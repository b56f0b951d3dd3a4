"""The range image as the scanner sends it ("pitch" in its development kit).

While the stripe passes, the CCD is read frame after frame. For every sample the scanner adds up the brightness x, and x
times the number i of the frame; the quotient Σ(i·x)/Σx is the frame at which the middle of the stripe lay on the
sample: the temporal barycentre (US 6,151,118; hardware manual p. 57). Some 3.6 MB for a FINE shot with colour
(p. 59) leave nine bytes a sample: two sums of 32 bits and one brightness of eight fit. How the vendor packs them is not
known; the profile defines it. It may also send the quotient itself, as a fixed-point number.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.scsi.errors import BadReply
from drivers.vivid900.geometry.lenses import Mode
from drivers.vivid900.profile.encodings import NOT_MEASURED
from drivers.vivid900.profile.profile import Profile
from drivers.vivid900.profile.raster import Channel
from restore.scan import Bytes, Floats

# Frames are rounded to this fraction, whether the scanner divides or the driver, so that the scan does not depend
# on the encoding. It is a thousandth of the noise, which is 0.02 lines.
FRACTION = 1 << 16


@dataclass(frozen=True, eq=False)
class Pitch:
    """A range image before triangulation.

    frames     (rows, cols) float64 frame at which the stripe's middle crossed the sample, NaN where not measured.
    intensity  (rows, cols) uint8 brightest value that the sample had, 255 where the CCD was saturated; None when the
               scanner does not send it.
    shot       which shot since power-on it is of; None when the image does not say.
    """

    frames: Floats
    intensity: Bytes | None
    shot: int | None = None


@dataclass(frozen=True, eq=False)
class Sums:
    """Accumulated sums per sample, each (rows, cols).

    Σx and Σ(i·x) are uint32, the brightest x uint8.
    """

    sum: NDArray[np.uint32]
    moment: NDArray[np.uint32]
    intensity: Bytes


def pitch_length(profile: Profile, mode: Mode) -> int:
    """Bytes of the range image of a mode, header and all."""
    return profile.blocks.pitch.length + profile.pitch.image.length(mode.rows, mode.cols)


def build_pitch(profile: Profile, sums: Sums, shot: int) -> bytes:
    """Encode the range image.

    Raises SettingsError when a sum does not fit into its bytes.
    """
    quotient = np.rint(_quotient(sums.sum, sums.moment) * profile.pitch.fraction)
    frame = np.where(np.isfinite(quotient), quotient, NOT_MEASURED).astype(np.uint32)
    payload = profile.pitch.image.encode({**vars(sums), "frame": frame})
    rows, cols = sums.sum.shape
    return profile.blocks.pitch.build({"shot": shot, "rows": rows, "cols": cols}, payload)


def parse_pitch(profile: Profile, mode: Mode, data: bytes) -> Pitch:
    """Read the range image of a mode.

    A sample without light, or whose barycentre lies outside the sweep, is NaN. Raises BadReply when the length, the
    header or the checksum is wrong.
    """
    header, image = profile.blocks.pitch, profile.pitch.image
    values = header.parse(data, payload=image.length(mode.rows, mode.cols))
    rows, cols = values.get("rows", mode.rows), values.get("cols", mode.cols)
    if (rows, cols) != (mode.rows, mode.cols):
        raise BadReply(f"a range image of {cols}×{rows} samples came, not {mode.cols}×{mode.rows}")
    try:
        channels = image.decode(data[header.length :], rows, cols)
    except ValueError as error:
        raise BadReply(f"cannot decode the range image: {error}") from error
    frames = np.rint(_frames(channels, profile.pitch.fraction) * FRACTION) / FRACTION
    frames[frames > mode.rows + mode.frames] = np.nan
    intensity = channels.get("intensity")
    brightest = None if intensity is None else np.ascontiguousarray(intensity, np.uint8)
    return Pitch(frames, brightest, values.get("shot"))


def _frames(channels: Mapping[str, Channel], fraction: int) -> Floats:
    if "frame" not in channels:
        return _quotient(channels["sum"], channels["moment"])
    frame = channels["frame"].astype(np.uint32)
    return np.where(frame == NOT_MEASURED, np.nan, frame / fraction)


def _quotient(total: Channel, moment: Channel) -> Floats:
    """Compute the barycentre (rows, cols), frames; NaN without light."""
    light = total.astype(float)
    return np.divide(moment.astype(float), light, out=np.full(light.shape, np.nan), where=light > 0)
