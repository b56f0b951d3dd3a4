"""`python -m bench.shift`: a shift of ten pages at a simulated scanner as its operator sees it.

One shot is out of focus, one leaf was not turned and one page lies half outside the picture. Prints each key and what
is on the screen after it, then what the session holds.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from bench.reproduce import restore_now
from drivers.simulated import Text
from drivers.simulated.imaging.shot import printed
from restore import RangeScan
from station.capture_loop.loop import CaptureLoop
from station.run.small_page import small_page
from station.session import Volume, create_session, open_session, read_session
from station.session.derivation.service import Done
from station.session.fixity.verify import verify
from station.session.leaves.overview import overview_lines
from station.session.terms.presets import load_preset

PAGE_MM = (106.0, 75.0)
PIXELS, MARGIN = 8, 24  # of the picture: for each sample, and of the dark table around the leaf
DARK, PAPER = 20, 0.85  # grey level of the table; light on white paper
BLUR_PX = 3.0
# Pages in the order in which they lie before the scanner, and the keys between them.
SHOTS = ("1", "2", "3 blurred", "3", "4", "4", "5", "6 cut", "6", "7", "8", "9", "10")
KEYS = (*" \n \n r\n \n r\n r\n \n m\nu\n", " ", *"nleaf torn at the foot\n", "\n", " ", "\n")
NAMES = {" ": "space", "\n": "enter"}


def main() -> int:
    """Work the shift. Returns 1 when the session is not sound."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "missale"
        settings = load_preset("book").model_dump(mode="json", exclude_none=True)
        create_session(folder, Volume(title="Missale", project="P 12", preset_values=settings))
        _work(folder)
        print(*overview_lines(read_session(folder)), sep="\n")
        inspection = verify(folder)
        print(f"verify: {len(inspection.found)} files, {len(inspection.problems)} problems")
    return 1 if inspection.problems else 0


def _work(folder: Path) -> None:
    """Press every key, and wait after each until what was shot is judged, so that the screen is always the same."""
    shots = _shots()
    with open_session(folder) as writer:
        loop = CaptureLoop(writer, lambda: next(shots), restore_now, lambda line: print(f"    {line.text}", flush=True))
        for key in KEYS:
            print(f"[{NAMES.get(key, key)}]", flush=True)
            loop.type(key)
            while loop.is_busy:
                message = loop.inbox.get()
                assert isinstance(message, Done)
                loop.finish(message)


def _shots() -> Iterator[RangeScan]:
    for shot in SHOTS:
        number, _, fault = shot.partition(" ")
        yield _shot(int(number), fault)


def page_scan(number: int, *, cut: bool = False) -> RangeScan:
    """A scan of a small curled leaf with a text of its own; `cut`: its left side lies at the edge of the picture."""
    leaf = small_page()
    rows, cols = leaf.points.shape[:2]
    size = (cols * PIXELS, rows * PIXELS)
    artwork = Text(seed=number, title_pt=12.0, sizes_pt=(9.0,), margin_mm=8.0, columns=1 + number % 2)
    text = cv2.resize(printed(artwork, PAGE_MM).image, size, interpolation=cv2.INTER_AREA)
    left = 0 if cut else MARGIN
    picture = np.full((size[1] + 2 * MARGIN, size[0] + left + MARGIN, 3), DARK, np.uint8)
    picture[MARGIN : MARGIN + size[1], left : left + size[0]] = text * PAPER
    return replace(
        leaf, texture=picture, texture_xy=leaf.texture_xy * PIXELS + (PIXELS / 2 + left, PIXELS / 2 + MARGIN)
    )


def _shot(number: int, fault: str) -> RangeScan:
    scan = page_scan(number, cut=fault == "cut")
    if fault == "blurred" and scan.texture is not None:
        return replace(scan, texture=cv2.GaussianBlur(scan.texture, (0, 0), BLUR_PX))
    return scan


if __name__ == "__main__":
    sys.exit(main())
