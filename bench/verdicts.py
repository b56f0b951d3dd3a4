"""`python -m bench.verdicts`: the measures behind a verdict, of good shots and of shots with one fault each.

The limits of the presets stand between the two. Then how alike pages of running text are that share title, margins and
type: each with itself, shot again, and with the others of its volume.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from bench.shift import page_scan
from drivers.simulated import Text
from restore import RangeScan, save_scan
from restore.scan import Bytes
from station.session.derivation.restoration import run_restore
from station.session.terms.presets import load_preset
from station.verdict.same_page import fingerprint, similarity
from station.verdict.thresholds import Thresholds

# Page, columns, size of the type.
VOLUMES = (
    ((148.0, 210.0), 1, 11.0),
    ((170.0, 240.0), 2, 9.0),
    ((210.0, 297.0), 1, 12.0),
    ((120.0, 180.0), 1, 10.0),
    ((106.0, 75.0), 1, 12.0),
)
PAGES = 8
NAMES = [name for name in Thresholds.model_fields if name != "similarity"]


def main() -> int:
    """Print a row of the table for each shot, then how alike pages are. Returns 0."""
    parameters = load_preset("book").parameters()
    print("| shot | " + " | ".join(NAMES) + " |\n|" + "---|" * (len(NAMES) + 1), flush=True)
    fingerprints = dict[str, str]()
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, scan) in enumerate(_shots()):
            save_scan(scan, Path(folder) / f"{number}.scan")
            result = run_restore(Path(folder) / f"{number}.scan", parameters, Path(folder) / str(number)).result
            cells = [_cell(result["measures"][one]) for one in NAMES] if "measures" in result else [result["error"]]
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
            if "measures" in result:
                fingerprints[name] = result["measures"]["fingerprint"]
    for other in ("the same page again", "another page", "page three"):
        print(f"similarity of a good shot and {other}: {similarity(fingerprints['good'], fingerprints[other]):.2f}")
    print("page mm    columns  type pt   the same page, least   another page, most")
    for seed, (page_mm, columns, type_pt) in enumerate(VOLUMES):
        same, others = _volume(page_mm, columns, type_pt, seed)
        size = f"{page_mm[0]:g} × {page_mm[1]:g}"
        print(f"{size:<12}{columns:>6}{type_pt:>9g}{same:>23.2f}{others:>21.2f}", flush=True)
    return 0


def _volume(page_mm: tuple[float, float], columns: int, type_pt: float, seed: int) -> tuple[float, float]:
    """The least similarity of a page with itself, shot again, and the greatest with another page."""
    random = np.random.default_rng(seed)
    texts = [
        Text(title_pt=1.7 * type_pt, sizes_pt=(type_pt,), columns=columns, margin_mm=14, dpi=100, seed=int(one))
        for one in random.integers(2**31, size=PAGES)
    ]
    images = [np.array(text.print_on(page_mm).image) for text in texts]
    one, two = ([fingerprint(_shot_again(image, random)) for image in images] for _ in range(2))
    alike = np.array([[similarity(first, second) for second in two] for first in one])
    return float(np.diag(alike).min()), float(alike[~np.eye(PAGES, dtype=bool)].max())


def _shot_again(image: Bytes, random: np.random.Generator) -> Bytes:
    """A page at 100 dpi as another shot of it may restore it: turned, moved, in other light, more or less sharp."""
    height, width = image.shape[:2]
    turn = cv2.getRotationMatrix2D((width / 2, height / 2), random.uniform(-0.4, 0.4), 1 + random.uniform(-3e-3, 3e-3))
    turn[:, 2] += random.uniform(-3, 3, 2)
    moved = cv2.warpAffine(image, turn, (width, height), borderValue=(235, 235, 235)).astype(float)
    across, down = (np.linspace(-0.5, 0.5, count) * random.uniform(-0.3, 0.3) for count in (width, height))
    lit = moved * (random.uniform(0.7, 1.0) * (1 + across + down[:, None]))[..., None]
    sharp = cv2.GaussianBlur(lit, (0, 0), random.uniform(0.5, 1.5))
    return np.clip(sharp + random.normal(0, 2, sharp.shape), 0, 255).astype(np.uint8)


def _shots() -> Iterator[tuple[str, RangeScan]]:
    good = page_scan(1)
    assert good.texture is not None
    yield "good", good
    moved = good.texture_xy + (1.5, 0.7)
    light = np.clip(good.texture * 0.8, 0, 255).astype(np.uint8)
    yield "the same page again", replace(good, texture=light, texture_xy=moved)
    yield "another page", page_scan(2)
    yield "page three", page_scan(3)
    for blur in (1.0, 2.0, 3.0):
        yield f"out of focus by {blur:g} px", replace(good, texture=cv2.GaussianBlur(good.texture, (0, 0), blur))
    yield "a fifth more light", replace(good, texture=np.clip(good.texture * 1.2, 0, 255).astype(np.uint8))
    yield "its left side at the edge of the image", page_scan(1, cut=True)
    points = good.points.copy()
    points[15:25, 20:28] = np.nan
    yield "a dark stain of 8 × 10 samples", replace(good, points=points)


def _cell(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"


if __name__ == "__main__":
    sys.exit(main())
