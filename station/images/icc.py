"""ICC profiles of three primaries and a tone curve (ICC.1:2010, version 4.3)."""

from __future__ import annotations

import hashlib
import struct
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np

from restore import BadInput
from restore.formats import read_bytes
from restore.scan import Floats

# D50, the white of all profiles (ICC.1:2010, 7.2.16), and D65 as CIE 15 gives it, X and Z for Y = 1.
D50 = np.array([0.9642, 1.0, 0.8249])
D65 = np.array([0.95047, 1.0, 1.08883])
# Cone responses of the Bradford transform (ICC.1:2010, annex E).

BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
SRGB_XY = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))  # IEC 61966-2-1
# g, a, b, c, d of Y = (aX + b)^g from d on and cX below it (ICC.1:2010, table 65): IEC 61966-2-1.
SRGB_CURVE = (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
HEADER = 128
VERSION = 0x04300000
WHEN = (2020, 1, 1, 0, 0, 0)  # the same profile is the same bytes, whenever it is written
COPYRIGHT = "No copyright, use freely"

Curve = tuple[float, float, float, float, float]


@dataclass(frozen=True, eq=False)
class MatrixProfile:
    """Colours as codes 0 to 1, through curves, then the matrix (3, 3) to XYZ under D50.

    kind: "mntr" for the colours of a screen, "scnr" for those of a scanner or camera.
    curves: red, green, blue.
    """

    name: str
    matrix: Floats
    curves: tuple[Curve, Curve, Curve]
    kind: Literal["mntr", "scnr"] = "mntr"


def adaptation(white: Floats) -> Floats:
    """Return the matrix (3, 3) from XYZ under a white (3,) to D50, by Bradford."""
    gain = np.diag((BRADFORD @ D50) / (BRADFORD @ white))
    return np.asarray(np.linalg.inv(BRADFORD) @ gain @ BRADFORD)


def srgb_matrix() -> Floats:
    """Return the matrix (3, 3) from linear sRGB to XYZ under D50."""
    primaries = np.array([[x / y, 1.0, (1 - x - y) / y] for x, y in SRGB_XY]).T
    return np.asarray(adaptation(D65) @ (primaries * np.linalg.solve(primaries, D65)))


@cache
def srgb_profile() -> bytes:
    """The profile of sRGB."""
    return encode_profile(MatrixProfile("sRGB", srgb_matrix(), (SRGB_CURVE, SRGB_CURVE, SRGB_CURVE)))


def encode_profile(profile: MatrixProfile) -> bytes:
    """The profile as an ICC file."""
    tags = {
        b"desc": _text(profile.name),
        b"cprt": _text(COPYRIGHT),
        b"wtpt": _xyz(D50),
        b"chad": b"sf32" + bytes(4) + _fixed(*adaptation(D65).ravel()),
        **{key: _xyz(column) for key, column in zip((b"rXYZ", b"gXYZ", b"bXYZ"), profile.matrix.T, strict=True)},
        **{key: _curve(curve) for key, curve in zip((b"rTRC", b"gTRC", b"bTRC"), profile.curves, strict=True)},
    }
    table, body = struct.pack(">I", len(tags)), b""
    start = HEADER + 4 + 12 * len(tags)
    for key, data in tags.items():
        table += key + struct.pack(">II", start + len(body), len(data))
        body += data + bytes(-len(data) % 4)
    plain = _header(profile.kind, start + len(body)) + table + body
    # The identity is the MD5 of the profile with intent, flags and identity zero, as they are here (7.2.18).
    return plain[:84] + hashlib.md5(plain, usedforsecurity=False).digest() + plain[100:]


def read_profile(path: Path) -> bytes:
    """Read an ICC profile of RGB colours from its file.

    Raises BadInput when it is missing, damaged or of other colours.
    """
    data = read_bytes(path)
    if len(data) < HEADER or data[36:40] != b"acsp" or struct.unpack_from(">I", data)[0] != len(data):
        raise BadInput(f"{path} is not an ICC profile", "give a file that `planish colour` wrote")
    if data[16:20] != b"RGB ":
        raise BadInput(f"{path} is not a profile of RGB colours", "give a file that `planish colour` wrote")
    return data


def _header(kind: str, size: int) -> bytes:
    start = struct.pack(">I4xI4s4s4s6H4s", size, VERSION, kind.encode(), b"RGB ", b"XYZ ", *WHEN, b"acsp")
    return (start.ljust(68, b"\0") + _fixed(*D50)).ljust(HEADER, b"\0")


def _fixed(*values: float) -> bytes:
    return struct.pack(f">{len(values)}i", *(round(value * 65536) for value in values))


def _xyz(values: Floats) -> bytes:
    return b"XYZ " + bytes(4) + _fixed(*values)


def _curve(curve: Curve) -> bytes:
    return b"para" + bytes(4) + struct.pack(">HH", 3, 0) + _fixed(*curve)


def _text(text: str) -> bytes:
    data = text.encode("utf-16-be")
    return b"mluc" + bytes(4) + struct.pack(">II", 1, 12) + b"enUS" + struct.pack(">II", len(data), 28) + data
