"""`python -m bench.phone_optics [--seed S] [--width 1200]`: what phones do to a picture, and what it costs a page.

One fresh wave is photographed five times from the same places, once as by an ideal camera and once each with what a
phone does: focus breathing and stabilisation (a focal length and principal point of each shot's own), the hand's turn
while the rows are read (rolling shutter), and all of it. Errors in mm as `bench.photographs` has them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bench.draws import seed_of_today
from bench.photographs import measured
from drivers.simulated import Text, Wave
from oracles.simulation.camera import Camera, Exposure, photograph_scene
from oracles.simulation.photographs import PhotographSet, Shots, photograph_page
from oracles.simulation.rolling import RollingCamera
from restore.photogrammetry import SCALE_CARD

CARD_DPI = 177.8  # seven pixels to a millimetre
BREATHING = 1e-3  # standard deviation of the focal length, as a share
SHIFT = 1e-3  # of the principal point, in widths of the picture: four pixels of a phone's 4000
TREMOR_DEG = 0.03  # of the turn about each axis during a readout: a degree a second for a thirtieth
ROW = "{:<18} {:>8} {:>8} {:>9} {:>9} {:>8} {:>7} {:>6}"
HEADINGS = ("camera", "rms", "99 %", "of print", "scale", "size", "joined", "cpu s")


def main(seed: int | None, width: int) -> None:
    """Print a line for each kind of camera."""
    seed = seed or seed_of_today()
    rng = np.random.default_rng(seed)
    sheet = Wave(slope_deg=rng.uniform(15, 30), wavelength_mm=rng.uniform(90, 160))
    artwork = Text(sizes_pt=(10.0,), title_pt=16.0, margin_mm=10.0, columns=2, seed=seed)
    card, shots = SCALE_CARD.picture(CARD_DPI), Shots(size=(width, width * 3 // 4))
    taken = photograph_page(
        sheet, artwork, views=5, seed=seed, card=card, card_dpi=CARD_DPI, shots=shots, page_mm=(160.0, 110.0)
    )
    print(f"{width} × {width * 3 // 4}, seed {seed}; mm\n{ROW.format(*HEADINGS)}", flush=True)
    print(ROW.format("ideal", *measured(taken)), flush=True)
    for name, changes in KINDS.items():
        cameras = [_changed(camera, changes, rng) for camera in taken.cameras]
        print(ROW.format(name, *measured(_again(taken, cameras, rng))), flush=True)


def breathing(camera: Camera, rng: np.random.Generator) -> Camera:
    """The camera with a focal length of its own."""
    return replace(camera, focal_px=camera.focal_px * (1 + BREATHING * rng.standard_normal()))


def stabilised(camera: Camera, rng: np.random.Generator) -> Camera:
    """The camera with a principal point of its own."""
    x, y = np.array(camera.centre) + SHIFT * camera.size[0] * rng.standard_normal(2)
    return replace(camera, centre=(float(x), float(y)))


def rolling(camera: Camera, rng: np.random.Generator) -> Camera:
    """The camera in a hand that turns while the rows are read."""
    right, down, forward = TREMOR_DEG * rng.standard_normal(3)
    return RollingCamera.of(camera, (float(right), float(down), float(forward)))


Change = Callable[[Camera, np.random.Generator], Camera]
KINDS: dict[str, tuple[Change, ...]] = {
    "breathing": (breathing,),
    "stabilised": (stabilised,),
    "rolling shutter": (rolling,),
    "all three": (breathing, stabilised, rolling),
}


def _changed(camera: Camera, changes: Sequence[Change], rng: np.random.Generator) -> Camera:
    for change in changes:
        camera = change(camera, rng)
    return camera


def _again(taken: PhotographSet, cameras: Sequence[Camera], rng: np.random.Generator) -> PhotographSet:
    """The scene photographed again by other cameras."""
    images = [photograph_scene(taken.scene, camera, Exposure(), rng) for camera in cameras]
    return PhotographSet(tuple(images), tuple(cameras), taken.scene)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--width", type=int, default=1200)
    options = parser.parse_args()
    main(options.seed, options.width)
