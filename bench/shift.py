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

from bench.replay import restore_now
from drivers.simulated import Curl, Text
from drivers.simulated import shoot as simulate
from restore import RangeScan
from station.session import Volume, create_session, open_session, read_session
from station.session.overview import overview_lines
from station.session.presets import load_preset
from station.session.verify import verify
from station.shift.loop import Done, Shift

PAGE_MM, LARGE_MM = (200.0, 150.0), (420.0, 150.0)
BLUR_PX = 3.0
# Pages in the order in which they lie before the scanner, and the keys between them.
SHOTS = ("1", "2", "3 blurred", "3", "4", "4", "5", "6 large", "6", "7", "8", "9", "10")
KEYS = (
    " ",
    "\n",
    " ",
    "\n",
    " ",
    "r",
    "\n",
    " ",
    "\n",
    " ",
    "r",
    "\n",
    " ",
    "r",
    "\n",
    " ",
    "\n",
    " ",
    "m",
    "\n",
    "u",
    "\n",
)
KEYS += (" ", *"nleaf torn at the foot\n", "\n", " ", "\n")
NAMES = {" ": "space", "\n": "enter"}


def main() -> int:
    """Work the shift. Returns 1 when the session is not sound."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "missale"
        settings = load_preset("book").model_dump(mode="json", exclude_none=True)
        create_session(folder, Volume(title="Missale", project="P 12", settings=settings))
        _work(folder)
        print(*overview_lines(read_session(folder)), sep="\n")
        inspection = verify(folder)
        print(f"verify: {len(inspection.found)} files, {len(inspection.problems)} problems")
    return 1 if inspection.problems else 0


def _work(folder: Path) -> None:
    """Press every key, and wait after each until what was shot is judged, so that the screen is always the same."""
    shots = _shots()
    with open_session(folder) as writer:
        shift = Shift(writer, lambda: next(shots), restore_now, lambda line: print(f"    {line}", flush=True))
        for key in KEYS:
            print(f"[{NAMES.get(key, key)}]", flush=True)
            shift.type(key)
            while shift.is_busy:
                message = shift.inbox.get()
                assert isinstance(message, Done)
                shift.finish(message)


def _shots() -> Iterator[RangeScan]:
    for shot in SHOTS:
        number, _, fault = shot.partition(" ")
        yield _shot(int(number), fault)


def page_scan(number: int, *, page_mm: tuple[float, float] = PAGE_MM, noise: int = 1) -> RangeScan:
    """A FAST shot of a curled page of text. number: which text; noise: seed of the scanner's."""
    artwork = Text(seed=number, title_pt=14.0, sizes_pt=(12.0,), columns=1 + number % 2)
    scan, _ = simulate(Curl(), artwork, mode="fast", seed=noise, page_mm=page_mm)
    return scan


def _shot(number: int, fault: str) -> RangeScan:
    scan = page_scan(number, page_mm=LARGE_MM if fault == "large" else PAGE_MM, noise=number)
    if fault == "blurred" and scan.texture is not None:
        return replace(scan, texture=cv2.GaussianBlur(scan.texture, (0, 0), BLUR_PX))
    return scan


if __name__ == "__main__":
    sys.exit(main())
