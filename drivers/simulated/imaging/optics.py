"""Optics of the simulated range sensor: rays, shadows, depth window, noise, outliers.

The stripe position is measured in CCD lines. Every disturbance shifts the apparent pitch of a sample, and so moves the
point along its line of sight. `body` is the true calibration of the simulated body; the driver learns of it only
through measurements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.scene.albedo import LINEAR, red_reflectance
from drivers.simulated.scene.artwork.printed import PAPER
from drivers.simulated.scene.scene import Scene
from drivers.vivid900.geometry.calibration import Calibration
from drivers.vivid900.geometry.lenses import LENSES, Mode
from drivers.vivid900.geometry.triangulation import in_window, lines_of_sight, pitch_of
from restore.scan import Floats, Ints, Mask

LENS_CENTRE = np.zeros(3)
# A lit point is met by the laser at its own distance within this; single-precision rays err by 1e-4 mm.
SHADOW_MM = 0.05

ROW_KERNEL = np.array([1.0, 1 / 3]) / np.hypot(1.0, 1 / 3)
"""Weights that correlate unit noise by 0.3 with the next sample along the stripe.

Not farther on, nor across, as the residuals of a range scan of the sister model Vivid 700 show (0.31, 0.03 and 0.01).
Cf. Sun, Rosin, Martin, Langbein, "Noise in 3D laser range scanner data", SMI 2008.
"""

# Signals are in units of white paper at the reference distance, square to the laser: automatic exposure keeps it there.
NOISE_FLOOR_SIGNAL = 0.5  # down to here the published precision holds; below, photon noise grows as 1/√signal
DETECTION_SIGNAL = 0.038  # threshold of detection: with this speckle, a third of the samples on carbon black miss it
SATURATION_SIGNAL = 4.0  # the CCD saturates: two stops above paper
SPECKLE_LOOKS = 4.0  # speckle grains that one sample averages; its brightness is gamma distributed with this shape
STRAY_DROPOUTS = 0.001  # fraction of samples lost on good paper too
OUTLIERS = 0.015  # one or two samples in a hundred at edges of depth or ink are mixed from both sides …
OUTLIER_LINES = 3.0  # … and lie up to this many lines off
EDGE_LINES = 2.0  # neighbours farther apart than this lie on different surfaces: 70° walls stay below it
EDGE_SIGNAL = 3.0  # neighbours whose signals have a greater ratio lie on different inks
GLOSS_DEG = 4.0  # coated paper mirrors the laser into the lens where its normal is this close to half-way to both …
GLOSS_SIGNAL = 30.0  # … and is then brighter than paper by this


@dataclass(frozen=True, eq=False)
class RayHits:
    """Intersections of the lines of sight of one shot with the scene, before any noise.

    points  (rows, cols, 3) mm, NaN where a line of sight meets nothing.
    flat    (rows, cols, 2) mm from the lower left corner of the page, NaN off the page.
    signal  (rows, cols) laser light that returns, 1 for white paper at the reference distance, 0 where the laser does
            not reach.
    """

    points: Floats
    flat: Floats
    signal: Floats


def trace_rays(
    scene: Scene, caster: RayCaster, maps: FaceMaps, body: Calibration, mode: Mode, reference_mm: float
) -> RayHits:
    """Intersect a mode's lines of sight with the scene, and find the returned laser light.

    A point is lit only when camera and laser see the same side of it. `reference_mm` is the depth in focus.
    """
    sight, laser = lines_of_sight(body, mode).tangents, np.array([0.0, -body.baseline_mm, 0.0])
    rays = np.concatenate([sight, np.full((*sight.shape[:2], 1), -1.0)], axis=-1)
    face, _ = caster.first_hit(LENS_CENTRE, rays)
    seen = face >= 0
    face = face[seen]
    points = maps.meet(face, rays[seen])
    uv = maps.page(face, points)
    footprint = reference_mm * float(np.median(np.diff(sight[0, :, 0])))
    red = red_reflectance(scene, footprint)(face, uv)[:, 0] / LINEAR[PAPER[0]]
    signal = red * (reference_mm / points[:, 2]) ** 2 * _lit(caster, maps, face, points, laser)
    if scene.printed.gloss > 0:
        signal *= 1 + GLOSS_SIGNAL * scene.printed.gloss * (
            scene.on_page[face] & _is_specular(maps, face, points, laser)
        )
    return RayHits(
        _scatter(seen, points),
        _scatter(seen, np.where(scene.on_page[face][:, None], uv, np.nan)),
        np.nan_to_num(_scatter(seen, signal[:, None])[..., 0]),
    )


def measure_pitch(
    hits: RayHits,
    body: Calibration,
    mode: Mode,
    distance_mm: float,
    rng: np.random.Generator,
    exposure: float = 1.0,
) -> Floats:
    """Return the measured pitch (rows, cols) of a capture focused at `distance_mm`, or NaN.

    exposure: laser power and gain relative to automatic exposure.
    """
    signal = hits.signal * exposure
    shape = signal.shape
    faintness = np.sqrt(np.maximum(NOISE_FLOOR_SIGNAL / np.maximum(signal, DETECTION_SIGNAL), 1))
    lines = line_noise(shape, rng) * LENSES[body.lens].line_noise * faintness
    is_outlier = edges(hits, body) & (rng.random(shape) < OUTLIERS)
    lines += np.where(is_outlier, rng.uniform(-OUTLIER_LINES, OUTLIER_LINES, shape), 0)
    speckled = signal * rng.gamma(SPECKLE_LOOKS, 1 / SPECKLE_LOOKS, shape)
    lost = (speckled < DETECTION_SIGNAL) | (signal > SATURATION_SIGNAL) | (rng.random(shape) < STRAY_DROPOUTS)
    # The stripe comes from above: a plane higher by a line was there sooner.
    return np.where(lost, np.nan, exact_pitch(hits, body, mode, distance_mm) - lines / mode.step)


def exact_pitch(hits: RayHits, body: Calibration, mode: Mode, distance_mm: float) -> Floats:
    """Return the exact pitch (rows, cols), NaN outside the depth window and laser's reach."""
    pitch = pitch_of(hits.points, body, mode, distance_mm)
    return np.where(in_window(pitch, body, mode) & (hits.signal > 0), pitch, np.nan)


def line_noise(shape: tuple[int, int], rng: np.random.Generator) -> Floats:
    """Unit noise (rows, cols), normal and correlated along the row by ROW_KERNEL."""
    white = rng.standard_normal((shape[0], shape[1] + 1))
    return np.asarray(white[:, 1:] * ROW_KERNEL[0] + white[:, :-1] * ROW_KERNEL[1])


def edges(hits: RayHits, body: Calibration) -> Mask:
    """Return the samples that lie on another surface or ink than one of four neighbours.

    Returns (rows, cols) bool.
    """
    lines = np.nan_to_num(body.focal_px * body.baseline_mm / -hits.points[..., 2])
    signal = np.log(np.maximum(hits.signal, DETECTION_SIGNAL))
    edge = np.zeros(signal.shape, bool)
    for axis in (0, 1):
        step, contrast = (np.abs(np.diff(field, axis=axis)) for field in (lines, signal))
        jump = (step > EDGE_LINES) | (contrast > np.log(EDGE_SIGNAL))
        none = np.zeros_like(jump.take([0], axis))
        edge |= np.concatenate([jump, none], axis) | np.concatenate([none, jump], axis)
    return edge


def _lit(caster: RayCaster, maps: FaceMaps, face: Ints, points: Floats, laser: Floats) -> Floats:
    """Return the cosine (n,) of the laser's angle of incidence.

    0 in shadow or where laser and camera see different sides.
    """
    beam = points - laser
    length = np.linalg.norm(beam, axis=1)
    _, reach = caster.first_hit(laser, beam)
    incidence, view = maps.along_normal(face, beam) / length, maps.along_normal(face, points)
    clear = (incidence * view > 0) & (reach * length > length - SHADOW_MM)
    return np.where(clear, np.abs(incidence), 0.0)


def _is_specular(maps: FaceMaps, face: Ints, points: Floats, laser: Floats) -> Mask:
    """Return where specular reflection sends the laser into the lens.

    Returns (n,) bool.
    """
    to_lens, to_laser = -points, laser - points
    half = sum(way / np.linalg.norm(way, axis=1, keepdims=True) for way in (to_lens, to_laser))
    cosine = maps.along_normal(face, half) / np.linalg.norm(half, axis=1)
    return np.asarray(np.abs(cosine) > np.cos(np.radians(GLOSS_DEG)))


def _scatter(seen: Mask, values: Floats) -> Floats:
    """Scatter values to the samples that hit something.

    Returns (rows, cols, k), NaN elsewhere.
    """
    full = np.full((*seen.shape, values.shape[1]), np.nan)
    full[seen] = values
    return full
