"""`python -m oracles.console.leaves FOLDER [SECONDS]`: the console before a scanner of leaves of text.

The leaves lie in the order of `SHOTS`; which is next stands in a file, so that a server that was killed goes on.
The third is out of focus: whoever works the shift shoots it again. SECONDS: that the laser is on in a shot. Prints its
link.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from drivers.simulated import Text
from drivers.simulated.imaging.shot import printed
from drivers.vivid900.settings import VividSettings
from restore import RangeScan
from station.config import StationConfig
from station.console.serving import Address, serve
from station.console.state.app_state import AppState
from station.run.small_page import small_page

PAGE_MM = (106.0, 75.0)
PIXELS, MARGIN = 8, 24  # of the picture: for each sample, and of the dark table around the leaf
DARK, PAPER = 20, 0.85  # grey level of the table; light on white paper
BLUR_PX = 3.0
SHOTS = ("1", "2", "3 blurred", "3", "4", "5", "6", "7", "8", "9", "10", "11", "12")
NEXT = "next-shot"
LASER_S = 0.5  # that the laser is on: long enough to be seen
LENS, DISTANCE_MM = "MIDDLE", 900.0


class LeafScanner:
    """A scanner whose next leaf is named in a file."""

    identity = "LEAVES OF TEXT"

    def __init__(self, folder: Path, wait: Callable[[float], Any], laser_s: float) -> None:
        self._next, self._wait, self._laser_s = folder / NEXT, wait, laser_s

    def capture(self, settings: VividSettings, progress: Callable[[str, float], None]) -> RangeScan:
        """The next leaf; a preview, which is FAST, leaves it where it is."""
        number = int(self._next.read_text()) if self._next.exists() else 0
        for done in (0.0, 0.5):
            progress("scan", done)
            self._wait(self._laser_s / 2)
        if settings.mode == "fine":
            self._next.write_text(str(number + 1))
        leaf, _, fault = SHOTS[number % len(SHOTS)].partition(" ")
        return leaf_scan(int(leaf), settings.mode, blurred=fault == "blurred")

    def close(self) -> None:
        """Nothing is held."""

    def __enter__(self) -> LeafScanner:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def leaf_scan(number: int, mode: str, *, blurred: bool = False) -> RangeScan:
    """A scan of a small curled leaf with a text of its own."""
    leaf = small_page()
    rows, cols = leaf.points.shape[:2]
    size = (cols * PIXELS, rows * PIXELS)
    artwork = Text(seed=number, title_pt=12.0, sizes_pt=(9.0,), margin_mm=8.0, columns=1 + number % 2)
    picture = np.full((size[1] + 2 * MARGIN, size[0] + 2 * MARGIN, 3), DARK, np.uint8)
    inside = slice(MARGIN, MARGIN + size[1]), slice(MARGIN, MARGIN + size[0])
    picture[inside] = cv2.resize(printed(artwork, PAGE_MM).image, size, interpolation=cv2.INTER_AREA) * PAPER
    if blurred:
        picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), BLUR_PX))
    facts = {"lens": LENS, "mode": mode, "distance_mm": DISTANCE_MM, "time": datetime.now(UTC).isoformat()}
    position = leaf.texture_xy * PIXELS + (PIXELS / 2 + MARGIN, PIXELS / 2 + MARGIN)
    return replace(leaf, texture=picture, texture_xy=position, provenance=facts)


def main(folder: Path, laser_s: float = LASER_S) -> int:
    """Serve until a signal ends it."""
    from threading import Event

    config = StationConfig(scanner={"driver": "simulated", "lens": LENS})
    app_state = AppState(folder, config, open_scanner=lambda _config: LeafScanner(folder, Event().wait, laser_s))
    serve(app_state, Address(port=0), show=lambda link: print(link, flush=True))
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    sys.exit(main(Path(sys.argv[1]).resolve(), *map(float, sys.argv[2:])))
