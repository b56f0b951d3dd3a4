"""`python -m bench.shift`: a shift at a simulated scanner as its operator sees it, then verify and replay.

In the first ten pages one shot is out of focus, one leaf was not turned and one page lies half outside the picture.
Prints each key and what is on the screen after it, then how many files are sound and how many runs replay equal.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2

import drivers
from drivers import CaptureSettings
from restore import RangeScan
from station.session import Volume, create_session, open_session, read_session
from station.session.overview import overview_lines
from station.session.presets import load_preset
from station.session.replay import replay
from station.session.verify import verify
from station.shift.loop import Done, Shift
from station.shift.workers import background

SETTINGS = CaptureSettings(mode="fast")
PAGE_MM, LARGE_MM = (200.0, 150.0), (420.0, 150.0)
BLUR_PX = 3.0
# Pages of the first ten, in the order in which they lie before the scanner, and the keys between them.
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


def main(pages: int) -> int:
    """Work the shift, verify and replay it. Returns 1 when a run came out otherwise."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "missale"
        settings = load_preset("book").model_dump(mode="json", exclude_none=True)
        create_session(folder, Volume(title="Missale", project="P 12", settings=settings))
        _work(folder, pages)
        session = read_session(folder)
        print(*overview_lines(session), sep="\n")
        inspection = verify(folder)
        print(f"verify: {len(inspection.found)} files, {len(inspection.problems)} problems")
        start, count, differing = time.perf_counter(), 0, 0
        for one in replay(session, Path(name) / "scratch"):
            count, differing = count + 1, differing + bool(one.differing)
            if one.differing:
                print(f"page {one.event.page}, {one.event.name}: {', '.join(one.differing)} differ")
        print(f"replay: {count} runs, {count - differing} equal; {time.perf_counter() - start:.0f} s")
    return 1 if differing or inspection.problems else 0


def _work(folder: Path, pages: int) -> None:
    """Press every key, and wait after each until what was shot is judged, so that the screen is always the same."""
    shots = _shots(pages)
    with open_session(folder) as writer, background() as submit:
        shift = Shift(writer, lambda: next(shots), submit, lambda line: print(f"    {line}", flush=True))
        for key in (*KEYS, *" \n" * (pages - 10)):
            print(f"[{NAMES.get(key, key)}]", flush=True)
            shift.type(key)
            while shift.is_busy:
                message = shift.inbox.get()
                assert isinstance(message, Done)
                shift.finish(message)


def _shots(pages: int) -> Iterator[RangeScan]:
    for shot in (*SHOTS, *map(str, range(11, pages + 1))):
        number, _, fault = shot.partition(" ")
        yield _shot(int(number), fault)


def _shot(number: int, fault: str) -> RangeScan:
    artwork = {"name": "text", "seed": number, "title_pt": 14.0, "sizes_pt": [12.0], "columns": 1 + number % 2}
    scene = {
        "sheet": "binding",
        "artwork": artwork,
        "page_mm": LARGE_MM if fault == "large" else PAGE_MM,
        "table": "dark",
    }
    config = {"driver": "simulated", "lens": "MIDDLE", "distance_mm": 900, "seed": number, "scene": scene}
    with drivers.open_scanner(config) as scanner:
        scan = scanner.capture(SETTINGS)
    if fault == "blurred" and scan.texture is not None:
        return replace(scan, texture=cv2.GaussianBlur(scan.texture, (0, 0), BLUR_PX))
    return scan


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pages", type=int, default=20)
    sys.exit(main(parser.parse_args().pages))
