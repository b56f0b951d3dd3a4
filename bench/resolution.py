"""`resolved_ppi` against slanted edges: `python -m bench.resolution [SEED]`.

The report's figure comes from a page of text; the slanted edges are those of a square turned by 5°, printed on the
same page before the same camera. They are measured after ISO 12233: a line is fitted to the edge, the pixels round
it are sorted by their distance to it into quarters of a pixel, and the spectrum of the differences is the MTF. Their
MTF50, twice, times the pixels per inch there is what the figure should be, at most the latter.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from PIL import Image, ImageDraw

from drivers.simulated import Curl, Pose, Text, Wave
from drivers.simulated.imaging.shot import Truth, printed, shoot_scene
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.artwork.printed import BLACK, PAPER, Print
from drivers.simulated.scene.scene import Scene, place_sheet
from drivers.simulated.scene.sheets import Sheet
from drivers.simulated.scene.sheets.sheet import PageSize
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES, MODES
from oracles.simulation.camera import Exposure
from oracles.studio import VIEWS, take_photograph
from restore import FlatMesh, Photograph, RangeScan, Settings
from restore.photo import paint_registered, register_photographs
from restore.pipeline import Stopwatch
from restore.prepared.prepare import prepare
from restore.scan import Bytes, Floats
from restore.texture.page import paint_page
from restore.texture.resolution import resolved_fraction
from restore.texture.super_resolution import super_resolve

PAGE_MM = (240.0, 170.0)
SQUARE_MM, TURN_DEG, CLEAR_MM = 26.0, 5.0, 44.0
CORNER_MM = (205.0, 35.0)  # the middle of the square, from the page's lower left corner
REACH_MM = 5.0  # of an edge that is measured: the half of a disc round its middle
BINS = 4  # to a pixel
DISTANCE_MM, LENS = 900.0, LENSES["MIDDLE"]
NUDGES_MM = ((0.0, 0.0), (0.23, 0.02), (0.01, 0.24), (0.22, 0.25))
SIZE = (2400, 1600)
ALIKE = 0.15  # what the figure may be off
BLURS_PX = (0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True)
class WithSquare:
    """Text, and in a corner that is cleared of it a black square, turned."""

    text: Text

    def print_on(self, page_mm: PageSize) -> Print:
        """The print; its words are those of the text, a few of them covered by the square's surroundings."""
        plain = self.text.print_on(page_mm)
        picture = Image.fromarray(plain.image)
        draw, scale = ImageDraw.Draw(picture), plain.dpi / 25.4
        middle = np.array([CORNER_MM[0], page_mm[1] - CORNER_MM[1]])
        for side, turn, colour in ((CLEAR_MM, 0.0, PAPER), (SQUARE_MM, TURN_DEG, BLACK)):
            corners = (middle + _corners(side, turn)) * scale
            draw.polygon([tuple(corner) for corner in corners.tolist()], fill=colour)
        return Print(np.asarray(picture), page_mm, words=plain.words, dpi=plain.dpi)


def _corners(side: float, turn_deg: float) -> Floats:
    """(4, 2) corners of a square round the origin, y down."""
    turn = np.radians(turn_deg)
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    return np.asarray(np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * side / 2 @ axes)


def main(seed: int = 2026) -> None:
    """Print a line for each picture: the figure of the report, that of the slanted edges, and how they compare."""
    rng = np.random.default_rng(seed)
    print(f"{'picture':<34}{'reported':>10}{'slanted':>10}{'off':>8}   {'sampling':>8}")
    off = []
    for name, reported, slanted, sampling in _figures(rng):
        if reported is None:
            print(f"{name:<34}{'not measured':>10}{slanted:>10.1f}", flush=True)
            continue
        off.append(reported / slanted - 1)
        print(f"{name:<34}{reported:>10.1f}{slanted:>10.1f}{off[-1]:>+8.1%}   {sampling:>8.1f}", flush=True)
    print(f"within {ALIKE:.0%}: {sum(abs(o) <= ALIKE for o in off)} of {len(off)}")


def _figures(rng: np.random.Generator) -> Iterator[tuple[str, float | None, float, float]]:
    sheets: dict[str, Sheet] = {"curl": Curl(radius_mm=rng.uniform(150, 220)), "wave": Wave()}
    for number, (name, sheet) in enumerate(sheets.items()):
        text = Text(seed=int(rng.integers(1 << 20)), dpi=600)
        pose = (rng.uniform(-4, 4), rng.uniform(-4, 4))
        plain, target = (_scene(sheet, artwork, pose) for artwork in (text, WithSquare(text)))
        shots = len(NUDGES_MM) if number == 0 else 1
        (scans, _), (targets, truths) = (_shots(scene, shots) for scene in (plain, target))
        page = _flat(scans[0])
        yield f"{name}, scanner", *_scanner(page, targets[0].texture, truths[0], 1)
        if shots > 1:
            yield (
                f"{name}, --super-resolution {shots}",
                *_scanner(_flat(super_resolve(scans)), super_resolve(targets).texture, truths[0], 2),
            )
        yield from _photographed(name, page, plain, target, truths[0], rng)


def _photographed(
    name: str, page: FlatMesh, plain: Scene, target: Scene, truth: Truth, rng: np.random.Generator
) -> Iterator[tuple[str, float | None, float, float]]:
    camera = VIEWS["above"].camera(SIZE)
    for blur in BLURS_PX:
        taken = [
            take_photograph(s, camera, exposure=Exposure(blur_px=blur), seed=int(rng.integers(99)))
            for s in (plain, target)
        ]
        (one,) = register_photographs(page, [Photograph(taken[0])])
        label = f"{name}, photograph σ {blur:g} px"
        if one.registration is None:
            print(f"{label:<34}refused: {one.reason}", flush=True)
            continue
        _, (report,) = paint_registered(page, [one], 60.0)
        yield label, report["resolved_ppi"], *_slanted(taken[1], lambda p: camera.project(truth.surface(p)))


def _scene(sheet: Sheet, artwork: Artwork, pose: tuple[float, float]) -> Scene:
    depth = DISTANCE_MM + LENS.pupil_mm
    return place_sheet(sheet, printed(artwork, PAGE_MM), depth_mm=depth, pose=Pose(tilt_deg=pose[0], turn_deg=pose[1]))


def _shots(scene: Scene, count: int) -> tuple[list[RangeScan], list[Truth]]:
    made = [
        shoot_scene(
            scene.moved(np.array([*nudge, 0.0])), nominal(LENS), MODES["fine"], DISTANCE_MM, np.random.default_rng(k)
        )
        for k, nudge in enumerate(NUDGES_MM[:count])
    ]
    return [scan for scan, _ in made], [truth for _, truth in made]


def _flat(scan: RangeScan) -> FlatMesh:
    return prepare(scan).unroll(Settings(), Stopwatch(None)).fine


def _scanner(page: FlatMesh, texture: Bytes | None, truth: Truth, factor: int) -> tuple[float | None, float, float]:
    """The report's figure of a page of text, and the slanted edges in the texture of the page with the square."""
    assert texture is not None

    def project(points: Floats) -> Floats:
        """The nearest pixels are near enough: the edge itself is found in the picture."""
        away = np.nan_to_num(np.linalg.norm(truth.flat[None] - points[:, None, None], axis=3), nan=np.inf)
        rows, cols = np.unravel_index(away.reshape(len(points), -1).argmin(axis=1), truth.flat.shape[:2])
        return np.stack([cols, rows], axis=1) * float(factor) + (factor - 1) / 2

    return paint_page(page, 150.0).resolution.resolved_ppi, *_slanted(texture, project)


def _slanted(picture: Bytes, project: Callable[[Floats], Floats]) -> tuple[float, float]:
    """Effective and sampling ppi by the four edges of the square, medians; project: page mm to pixels."""
    corners = np.array(CORNER_MM) + _corners(SQUARE_MM, TURN_DEG) * [1, -1]
    middles = (corners + np.roll(corners, -1, axis=0)) / 2
    pixels, ends = project(middles), project(corners)
    spans = np.linalg.norm(np.roll(ends, -1, axis=0) - ends, axis=1) / SQUARE_MM
    # Across an edge the scale is that along its neighbours.
    across = (np.roll(spans, 1) + np.roll(spans, -1)) / 2 * 25.4
    light = _linear(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY))
    figures = [
        resolved_fraction(slanted_edge_mtf50(light, middle, REACH_MM * ppi / 25.4)) * ppi
        for middle, ppi in zip(pixels, across, strict=True)
    ]
    return float(np.median(figures)), float(np.median(across))


def slanted_edge_mtf50(light: Floats, middle: Floats, reach: float) -> float:
    """MTF50, cycles per pixel, of the straight edge that crosses a disc of `reach` pixels in linear light (h, w)."""
    y, x = np.mgrid[: light.shape[0], : light.shape[1]]
    inside = np.hypot(x - middle[0], y - middle[1]) < reach
    gx, gy = cv2.Sobel(light, cv2.CV_64F, 1, 0), cv2.Sobel(light, cv2.CV_64F, 0, 1)
    steep = np.hypot(gx, gy) * inside
    weight = np.where(steep > 0.3 * steep.max(), steep, 0.0)
    place = np.array([(x * weight).sum(), (y * weight).sum()]) / weight.sum()
    turn = 0.5 * np.arctan2(2 * (weight * gx * gy).sum(), (weight * (gx**2 - gy**2)).sum())
    # The page bends: the line is a parabola, fitted twice, the second time to what is near.
    along = (y - place[1]) * np.cos(turn) - (x - place[0]) * np.sin(turn)
    across = (x - place[0]) * np.cos(turn) + (y - place[1]) * np.sin(turn)
    near = weight > 0
    for _ in range(2):
        curve = np.polyfit(along[near], across[near], 2, w=weight[near])
        near = (weight > 0) & (np.abs(across - np.polyval(curve, along)) < 0.25 * reach)
    distance = across - np.polyval(curve, along)
    return _mtf50(distance[inside], light[inside], reach)


def _mtf50(distance: Floats, light: Floats, reach: float) -> float:
    """The frequency at which the spectrum of an edge, sampled at distances from it, falls to a half."""
    half = int(0.7 * reach * BINS)
    number = np.rint(distance * BINS).astype(int) + half
    kept = (number >= 0) & (number <= 2 * half)
    total = np.bincount(number[kept], light[kept], 2 * half + 1)
    count = np.bincount(number[kept], minlength=2 * half + 1)
    filled = np.flatnonzero(count)
    profile = np.interp(np.arange(2 * half + 1), filled, total[filled] / count[filled])
    spread = np.diff(profile) * np.hamming(2 * half)
    frequency = np.fft.rfftfreq(16 * len(spread), 1.0 / BINS)
    mtf = np.abs(np.fft.rfft(spread, 16 * len(spread)))
    mtf = mtf / mtf[0] / np.sinc(frequency / BINS) ** 2  # of the differences and of the bins
    below = int(np.argmax(mtf < 0.5))
    return float(np.interp(0.5, [mtf[below], mtf[below - 1]], [frequency[below], frequency[below - 1]]))


def _linear(grey: Bytes) -> Floats:
    share = grey / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
