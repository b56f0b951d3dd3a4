"""CIE L*a*b* under D50, and the CIEDE2000 difference."""

from __future__ import annotations

import numpy as np

from restore.scan import Floats
from station.images.icc import D50, srgb_matrix

BEND = 6 / 29  # below this cube root the lightness curve is straight (CIE 15:2004, 8.2.1.1)


def lab_of_xyz(xyz: Floats) -> Floats:
    """Convert XYZ under D50, Y = 1 for white, to L*a*b*.

    xyz: (…, 3). Returns (…, 3).
    """
    relative = np.asarray(xyz) / D50
    f = np.where(relative > BEND**3, np.cbrt(relative), relative / (3 * BEND**2) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def lab_of_linear(light: Floats) -> Floats:
    """Convert linear sRGB (…, 3) to L*a*b* (…, 3)."""
    return lab_of_xyz(np.asarray(light) @ srgb_matrix().T)


def luminance(light: Floats) -> Floats:
    """Return the luminance Y (…), 1 for white, of linear sRGB (…, 3)."""
    return np.asarray(np.asarray(light) @ srgb_matrix()[1])


def luminance_of_lab(lab: Floats) -> Floats:
    """Return the luminance Y (…), 1 for white, of L*a*b* (…, 3)."""
    f = (np.asarray(lab)[..., 0] + 16) / 116
    return np.where(f > BEND, f**3, 3 * BEND**2 * (f - 4 / 29))


def difference(a: Floats, b: Floats) -> Floats:
    """Return CIEDE2000 (…) between colours (…, 3) L*a*b*.

    G. Sharma, W. Wu, E. Dalal, "The CIEDE2000 color-difference formula: implementation notes", Color Research and
    Application 30(1), 2005, eqs. 2–22, all parametric weights 1.
    """
    light_a, light_b = a[..., 0], b[..., 0]
    mean_chroma = (np.hypot(a[..., 1], a[..., 2]) + np.hypot(b[..., 1], b[..., 2])) / 2
    stretch = 1 + 0.5 * (1 - np.sqrt(mean_chroma**7 / (mean_chroma**7 + 25.0**7)))
    (chroma_a, hue_a), (chroma_b, hue_b) = (_polar(stretch * c[..., 1], c[..., 2]) for c in (a, b))
    grey = chroma_a * chroma_b == 0
    turn = np.where(grey, 0.0, (hue_b - hue_a + 180) % 360 - 180)
    d_hue = 2 * np.sqrt(chroma_a * chroma_b) * np.sin(np.radians(turn / 2))
    hue = np.where(grey, hue_a + hue_b, (hue_a + turn / 2) % 360)
    lightness, chroma = (light_a + light_b) / 2, (chroma_a + chroma_b) / 2
    s_light = 1 + 0.015 * (lightness - 50) ** 2 / np.sqrt(20 + (lightness - 50) ** 2)
    s_chroma, s_hue = 1 + 0.045 * chroma, 1 + 0.015 * chroma * _hue_weight(hue)
    bend = 2 * np.sqrt(chroma**7 / (chroma**7 + 25.0**7))
    rotation = -np.sin(np.radians(60 * np.exp(-(((hue - 275) / 25) ** 2)))) * bend
    light, saturation, tint = (light_b - light_a) / s_light, (chroma_b - chroma_a) / s_chroma, d_hue / s_hue
    return np.asarray(np.sqrt(light**2 + saturation**2 + tint**2 + rotation * saturation * tint))


def _polar(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    return np.hypot(a, b), np.degrees(np.arctan2(b, a)) % 360


def _hue_weight(hue: Floats) -> Floats:
    waves = ((-0.17, 1, -30), (0.24, 2, 0), (0.32, 3, 6), (-0.20, 4, -63))
    return 1 + sum((size * np.cos(np.radians(times * hue + start)) for size, times, start in waves), np.zeros_like(hue))
