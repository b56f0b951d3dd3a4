"""Prints drawn at random, one family of them a function: what stands on the pages of `bench.light_families`."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from drivers.simulated import Text
from drivers.simulated.scene.albedo import LINEAR, srgb
from drivers.simulated.scene.artwork.printed import PAPER
from drivers.simulated.scene.artwork.printed import blank as white_paper
from drivers.simulated.scene.sheets import PageSize
from restore.scan import Bytes, Floats

DPI = 150  # three times what the camera resolves
MM = DPI / 25.4  # pixels
COLOURS = 9  # of a page of patches, across; three quarters as many down
TINT_CODES = (6, 34)  # of 255: how far a pastel lies from its paper in its strongest channel
GREYS = (30, 230)
SCREEN_LPI = (25, 60)  # of a halftone: newspapers and posters, what the camera half resolves

Draw = Callable[[np.random.Generator, PageSize], Bytes]


def text(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Running text in black on white paper."""
    sizes = tuple(float(size) for size in rng.choice([9.0, 11.0, 12.0, 14.0, 18.0], 2))
    return Text(sizes_pt=sizes, seed=int(rng.integers(1 << 16)), dpi=DPI).print_on(page_mm).image.copy()


def colour_patches(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Patches of saturated inks over most of the page, paper between them."""
    return _patches(_blank(page_mm), rng, lambda: rng.integers(20, 240, 3), rng.uniform(0.7, 0.9))


def greys(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Neutral fields of all sizes and ramps from black to white."""
    image = _patches(_blank(page_mm), rng, lambda: np.full(3, rng.integers(*GREYS)), rng.uniform(0.5, 0.95))
    height, width = image.shape[:2]
    for top in rng.uniform(0.05, 0.85, 2):
        ramp = np.linspace(*rng.permutation(GREYS), round(0.8 * width))
        image[round(top * height) : round((top + 0.1) * height), round(0.1 * width) :][:, : len(ramp)] = ramp[:, None]
    return image


def pastels(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Fields that are nearly paper, of all sizes, and text."""
    paper = text(rng, page_mm)

    def tint() -> Floats:
        return np.array(PAPER) - rng.uniform(0, 1, 3) * rng.uniform(*TINT_CODES)

    tinted = _patches(_blank(page_mm), rng, tint, rng.uniform(0.4, 0.95))
    return np.asarray((paper.astype(float) * tinted / PAPER).astype(np.uint8))


def stained(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Text on tinted paper with brown stains and browned edges."""
    light = LINEAR[text(rng, page_mm)] * LINEAR[np.array(PAPER) - rng.integers(0, 45, 3)] / LINEAR[np.array(PAPER)]
    brown = np.array([0.08, 0.22, 0.5]) * rng.uniform(0.3, 1)
    cloud = np.clip(3 * _cloud(rng, light.shape[:2], rng.uniform(10, 40)) - 1.5, 0, 1)
    border = np.minimum.reduce([np.indices(cloud.shape)[0], np.indices(cloud.shape)[1]])
    edge = np.exp(-border / (rng.uniform(3, 12) * MM))
    return _codes(light * (1 - brown * np.maximum(cloud, edge)[..., None]))


def halftones(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """A picture and fields in a dot screen, on paper with text."""
    image = text(rng, page_mm)
    height, width = image.shape[:2]
    tone = LINEAR[_scenery(rng, (height, width))].mean(axis=2)
    pitch = DPI / rng.uniform(*SCREEN_LPI)
    turn = np.radians(rng.uniform(0, 90))
    rows, cols = np.indices(tone.shape)
    waves = [np.cos(2 * np.pi / pitch * (cols * np.cos(a) + rows * np.sin(a))) for a in (turn, turn + np.pi / 2)]
    dots = (waves[0] + waves[1]) / 4 + 0.5 < tone
    box = _box(rng, tone.shape, (0.35, 0.8))
    ink = rng.integers(20, 90, 3) if rng.random() < 0.5 else np.full(3, 61)
    image[box] = np.where(dots[box][..., None], PAPER, ink)
    return image


def dark(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """A page all over in a dark colour, its text light."""
    ground = rng.integers(15, 75, 3)
    paper = text(rng, page_mm)
    ink = (np.array(PAPER) - paper)[..., :1] / (PAPER[0] - 61)
    light = rng.integers(170, 240, 3)
    return np.asarray(np.clip(ground + np.clip(ink, 0, 1) * (light - ground), 0, 255).astype(np.uint8))


def mostly_black(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Black fields with thin gaps of paper, and text in some of them turned white."""
    image = _patches(_blank(page_mm), rng, lambda: rng.integers(25, 60) + rng.integers(-6, 6, 3), 0.97)
    inverse = 255 - text(rng, page_mm)
    box = _box(rng, image.shape[:2], (0.3, 0.7))
    image[box] = np.maximum(inverse[box], 40)
    return image


def picture(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """A photograph that reaches the border."""
    return _scenery(rng, _blank(page_mm).shape[:2])


def dark_picture(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """A photograph by night that reaches the border, with a line of light text."""
    night = _codes(LINEAR[picture(rng, page_mm)] ** rng.uniform(1.3, 2.0) * rng.uniform(0.1, 0.4))
    box = _box(rng, night.shape[:2], (0.3, 0.1))
    night[box] = np.maximum(night[box], (255 - text(rng, page_mm))[box])
    return night


def magazine(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Text with a photograph and a coloured field."""
    image = text(rng, page_mm)
    box = _box(rng, image.shape[:2], (0.5, 0.6))
    image[box] = _scenery(rng, image.shape[:2])[box]
    image[_box(rng, image.shape[:2], (0.25, 0.2))] = rng.integers(60, 240, 3)
    return image


def ledger(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Draw a tinted page of an account book, with ruled lines and red columns."""
    paper = _tinted_paper(rng, (12, 40))
    image = np.broadcast_to(paper, _blank(page_mm).shape).astype(float)
    pitch, first = rng.uniform(6, 9) * MM, rng.uniform(12, 25) * MM
    for row in np.arange(first, len(image) - 5 * MM, pitch):
        image[round(row) : round(row) + 1] = paper * rng.uniform(0.55, 0.75)
    for col in rng.uniform(0.1, 0.95, int(rng.integers(3, 7))) * image.shape[1]:
        image[:, round(col) : round(col) + 2] = (170, 90, 90)
    ink = 1 - text(rng, page_mm) / np.array(PAPER)
    return np.asarray(np.clip(image * (1 - 0.8 * np.clip(ink, 0, 1)), 0, 255).astype(np.uint8))


def parchment(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Brown script on cream skin that is mottled, and darker towards its edges."""
    image = LINEAR[text(rng, page_mm)] / LINEAR[np.array(PAPER)]
    mottled = 1 - rng.uniform(0.03, 0.12) * _cloud(rng, image.shape[:2], rng.uniform(8, 40))
    ink = np.clip(1 - image, 0, 1) * rng.uniform(0.6, 1)
    cream = LINEAR[np.array([rng.integers(215, 235), rng.integers(195, 215), rng.integers(150, 185)])]
    brown = LINEAR[np.array([rng.integers(60, 100), rng.integers(40, 60), rng.integers(25, 40)])]
    return _codes(mottled[..., None] * (cream * (1 - ink) + brown * ink))


def rubrics(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Draw text on toned paper with lines, initials and borders in red and blue."""
    paper = np.array(PAPER) - np.array([0, rng.integers(3, 12), rng.integers(8, 35)])
    image = text(rng, page_mm).astype(float) * paper / PAPER
    red, blue = (180, 40, 35), (40, 60, 140)
    ink = np.clip(1 - image / paper, 0, 1).mean(axis=2, keepdims=True) * 1.4
    for top in rng.uniform(0.05, 0.9, int(rng.integers(2, 6))):
        rows = slice(round(top * len(image)), round((top + rng.uniform(0.02, 0.06)) * len(image)))
        share = np.clip(ink[rows], 0, 1)
        image[rows] = paper * (1 - share) + np.array(red) * share
    for _ in range(int(rng.integers(2, 6))):
        image[_box(rng, image.shape[:2], (0.08, 0.1))] = red if rng.random() < 0.6 else blue
    if rng.random() < 0.5:
        image[:, : round(rng.uniform(0.02, 0.06) * image.shape[1])] = blue
    return np.asarray(np.clip(image, 0, 255).astype(np.uint8))


def washes(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """A map: regions in pale washes that pool at their borders, contours, and names."""
    image = LINEAR[text(rng, page_mm)]
    for _ in range(int(rng.integers(3, 7))):
        field = _cloud(rng, image.shape[:2], rng.uniform(20, 70)) - rng.uniform(0.4, 0.6)
        inside, border = field > 0, np.abs(field) < 0.012
        colour = LINEAR[np.array(PAPER) - (rng.uniform(0, 1, 3) * 60).astype(int)] / LINEAR[np.array(PAPER)]
        pooled = 1 - rng.uniform(0.03, 0.1) * np.exp(-np.abs(field) / 0.05)
        image[inside] *= (colour * pooled[..., None])[inside]
        image[border] *= 0.4
    return _codes(image)


def comic(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Panels of flat colours with black outlines, white gutters and balloons with text."""
    image, words = _patches(_blank(page_mm), rng, lambda: rng.integers(60, 245, 3), 0.93), text(rng, page_mm)
    height, width = image.shape[:2]
    for _ in range(int(rng.integers(8, 20))):
        field = _cloud(rng, (height, width), rng.uniform(15, 40))
        box = _box(rng, (height, width), (0.25, 0.3))
        image[box] = np.where((field[box] > 0.55)[..., None], rng.integers(40, 245, 3), image[box])
        image[box] = np.where((np.abs(field[box] - 0.55) < 0.01)[..., None], 30, image[box])
    for _ in range(int(rng.integers(3, 7))):
        balloon = _box(rng, (height, width), (0.2, 0.12))
        image[balloon] = words[balloon]
    return image


def gradients(rng: np.random.Generator, page_mm: PageSize) -> Bytes:
    """Draw fields that run from one colour to another, some to the border."""
    image = text(rng, page_mm).astype(float)
    height, width = image.shape[:2]
    if rng.random() < 0.5:
        image *= _ramp(rng, (height, width), np.array(PAPER) - rng.uniform(0, 90, 3)) / PAPER
    for _ in range(int(rng.integers(1, 5))):
        box = _box(rng, (height, width), (0.6, 0.4))
        image[box] = _ramp(rng, image[box].shape[:2], rng.uniform(40, 240, 3))
    return np.asarray(np.clip(image, 0, 255).astype(np.uint8))


PRINTS: dict[str, Draw] = {
    draw.__name__.replace("_", " "): draw
    for draw in (
        text,
        colour_patches,
        halftones,
        stained,
        dark,
        mostly_black,
        picture,
        dark_picture,
        greys,
        pastels,
        magazine,
        ledger,
        parchment,
        rubrics,
        washes,
        comic,
        gradients,
    )
}


def _blank(page_mm: PageSize) -> Bytes:
    return white_paper(page_mm, DPI)


def _tinted_paper(rng: np.random.Generator, codes: tuple[int, int]) -> Floats:
    """Draw the codes (3,) of paper whose tint lies within `codes` of white."""
    tint = rng.uniform(*codes) * np.array([1.0, rng.uniform(0.3, 0.6), 1.0])[:: rng.choice([-1, 1])]
    return np.asarray(np.array(PAPER) - (tint if rng.random() < 0.6 else np.roll(tint, 1)))


def _ramp(rng: np.random.Generator, shape: tuple[int, ...], end: Floats) -> Floats:
    """Draw a gradient (h, w, 3) of codes that ends in the colour `end` (3,)."""
    start = np.array(PAPER, float) if rng.random() < 0.5 else rng.uniform(40, 240, 3)
    way = rng.normal(size=2)
    along = sum(part * axis / n for part, axis, n in zip(way, np.indices(shape), shape, strict=True))
    return np.asarray(start + (end - start) * ((along - along.min()) / np.ptp(along))[..., None])


def _patches(image: Bytes, rng: np.random.Generator, colour: Callable[[], Floats], filled: float) -> Bytes:
    """The image (h, w, 3) with a lattice of patches, each over a share of its cell, some of them larger."""
    height, width = image.shape[:2]
    across = int(rng.integers(3, COLOURS + 1))
    down = max(2, round(across * 0.75))
    for row in range(down):
        for col in range(across):
            top, left = (row + 0.5 - filled / 2) * height / down, (col + 0.5 - filled / 2) * width / across
            bottom, right = top + filled * height / down, left + filled * width / across
            image[round(top) : round(bottom), round(left) : round(right)] = colour()
    return image


def _box(rng: np.random.Generator, shape: tuple[int, ...], most: tuple[float, float]) -> tuple[slice, slice]:
    """A rectangle somewhere on a page (h, w), up to shares of its width and height in size."""
    sides = [round(n * share * rng.uniform(0.6, 1)) for n, share in zip(shape, most[::-1], strict=True)]
    starts = [round(rng.uniform(0, n - side)) for n, side in zip(shape, sides, strict=True)]
    rows, cols = (slice(start, start + side) for start, side in zip(starts, sides, strict=True))
    return rows, cols


def _scenery(rng: np.random.Generator, shape: tuple[int, ...]) -> Bytes:
    """(h, w, 3) a picture: clouds of several sizes over three fields of colour, with edges between them."""
    colours = LINEAR[rng.integers(10, 235, (4, 3))]
    light = np.broadcast_to(colours[0], (*shape, 3)).copy()
    for colour in colours[1:]:
        where = _cloud(rng, shape, rng.uniform(8, 60)) > rng.uniform(0.35, 0.65)
        light[where] = colour
    detail = _cloud(rng, shape, rng.uniform(0.5, 3)) + _cloud(rng, shape, rng.uniform(5, 30))
    return _codes(light * (0.3 + 0.7 * detail[..., None]))


def _cloud(rng: np.random.Generator, shape: tuple[int, ...], size_mm: float) -> Floats:
    """(h, w) smooth noise between 0 and 1 whose hills are about size_mm apart."""
    few = [max(4, round(n / MM / size_mm) + 4) for n in shape[:2]]
    field = cv2.resize(rng.random(few), shape[1::-1], interpolation=cv2.INTER_CUBIC)
    return np.asarray(np.clip(field, 0, 1))


def _codes(light: Floats) -> Bytes:
    return np.asarray(np.rint(srgb(light.astype(np.float32))).astype(np.uint8))
