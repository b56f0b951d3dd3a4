"""`python -m bench.photographed_words [--seed S] [--width 2800] [--views 5] [--sheets wave …]`: words, no scanner.

A page of 10-point text is photographed by hand in the simulated world and restored from the photographs alone. Its
words are read beside those of the print itself, of one photograph cut to the page, and of that photograph flattened by
`page-dewarp` (M. Zucker 2016, kept up by L. Maddox), which bends a cubic sheet until the lines of print are straight:
the method for single photographs that can be installed (`pipx install page-dewarp`; left out where it is not). Per cent
of words read right.
"""

from __future__ import annotations

import argparse
import itertools
import shutil
import subprocess
import tempfile
from pathlib import Path

import cv2
import numpy as np

from bench.draws import seed_of_today
from bench.photographs import CARD_DPI, MARGIN_MM, SHEETS
from drivers.simulated import Text
from drivers.simulated.scene.sheets import Sheet
from oracles.simulation.photographs import PhotographSet, Shots, photograph_page
from restore import Photograph, RestoreError, Settings, reconstruct_page, restore
from restore.photogrammetry import SCALE_CARD
from restore.scan import Bytes
from restore.texture.page import MM_PER_INCH
from station.images.png import encode_png
from station.words.ocr_precision import count_matching_words
from station.words.words import READING_DPI, recognise

PAGE_MM = (280.0, 200.0)
TYPE_PT = 10.0
PEER = "page-dewarp"
PEER_TIMEOUT_S = 300.0
RIM_POINTS = 100  # to a side of the page
ROW = "{:<8} {:>12} {:>12} {:>12} {:>14}"


def main(seed: int | None, width: int, views: int, sheets: list[str]) -> None:
    """Print a line for each kind of sheet."""
    seed = seed or seed_of_today()
    shots = Shots(size=(width, width * 3 // 4))
    print(
        f"{TYPE_PT:g}-point words read right, per cent; {views} views of {shots.size[0]} × {shots.size[1]}, seed {seed}"
    )
    print(ROW.format("sheet", "photograph", PEER, "restored", "the print"), flush=True)
    for number, (name, kind) in enumerate(SHEETS.items()):
        if sheets and name not in sheets:
            continue
        rng = np.random.default_rng([seed, number])
        sheet, print_seed = kind.draw(rng), int(rng.integers(2**31))
        print(ROW.format(name, *_cells(sheet, print_seed, views, shots)), flush=True)


def _cells(sheet: Sheet, seed: int, views: int, shots: Shots) -> list[str]:
    taken = _taken(sheet, seed, views, shots)
    printed = taken.scene.printed
    words = " ".join(word.text for word in printed.words)
    photograph = cropped(taken)
    pages = (photograph, dewarped(photograph), restored(taken), printed.image)
    return ["–" if page is None else f"{_precision(words, page):.1f}" for page in pages]


def _taken(sheet: Sheet, seed: int, views: int, shots: Shots) -> PhotographSet:
    artwork = Text(sizes_pt=(TYPE_PT,), title_pt=18.0, margin_mm=MARGIN_MM, seed=seed)
    card = SCALE_CARD.picture(CARD_DPI)
    return photograph_page(
        sheet, artwork, views=views, seed=seed, card=card, card_dpi=CARD_DPI, shots=shots, page_mm=PAGE_MM
    )


def _precision(words: str, page: Bytes) -> float:
    dpi = page.shape[1] / PAGE_MM[0] * MM_PER_INCH  # all of them end about where the page does
    return 100.0 * count_matching_words(words, recognise(page, dpi, name="page").text).precision


def cropped(taken: PhotographSet) -> Bytes:
    """The part of the first photograph (h, w, 3) that the page is in, as one would cut it out by hand."""
    image = taken.images[0]
    share = np.linspace(0.0, 1.0, RIM_POINTS)[:, None]
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) * PAGE_MM
    rim = np.concatenate([start + share * (end - start) for start, end in itertools.pairwise(corners)])
    seen = taken.cameras[0].project(taken.scene.surface(rim))
    left, top = np.clip(np.floor(seen.min(axis=0)).astype(int), 0, None)
    right, bottom = np.ceil(seen.max(axis=0)).astype(int) + 1
    return np.ascontiguousarray(image[top:bottom, left:right])


def restored(taken: PhotographSet) -> Bytes | None:
    """The page restored from the photographs alone, without its light; None when they are refused."""
    focal = Shots(size=taken.cameras[0].size).focal_px
    photographs = [Photograph(image, str(number), focal) for number, image in enumerate(taken.images)]
    try:
        page = reconstruct_page(photographs)
        return restore(page.mesh, Settings(dpi=READING_DPI, shading="remove"), photos=page.photographs).image
    except RestoreError as error:
        print(f"refused: {error}")
        return None


def dewarped(photograph: Bytes) -> Bytes | None:
    """What page-dewarp makes of one photograph, grey; None where it is not installed or gives nothing."""
    program = shutil.which(PEER)
    if program is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "page.png")
        source.write_bytes(encode_png(photograph))
        command = [program, "--no-binary", "1", "--output-dir", folder, str(source)]
        subprocess.run(command, cwd=folder, capture_output=True, timeout=PEER_TIMEOUT_S, check=False)
        made = sorted(set(Path(folder).glob("*.png")) - {source})
        picture = cv2.imread(str(made[0])) if made else None
    return None if picture is None else np.ascontiguousarray(picture[..., ::-1])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--width", type=int, default=2800)
    parser.add_argument("--views", type=int, default=5)
    parser.add_argument("--sheets", nargs="+", choices=tuple(SHEETS), default=[])
    options = parser.parse_args()
    main(options.seed, options.width, options.views, options.sheets)
