"""`python -m bench.replay`: a session of simulated pages is shot, restored and judged, then replayed.

Prints a line for each page, the seconds of shooting beside those of restoring, and how many runs came out equal.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import drivers
from drivers import CaptureSettings
from restore import RangeScan
from station.session import Volume, create_session, open_session, read_session
from station.session.presets import load_preset
from station.session.replay import replay
from station.session.verify import verify
from station.shift.loop import Shift
from station.shift.workers import background

SHEETS = ("binding", "curl", "multifold", "flat")
SETTINGS = CaptureSettings(mode="fast")


def main(pages: int) -> int:
    """Shoot, restore, verify, replay. Returns 1 when a run came out otherwise."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "volume"
        settings = load_preset("book").model_dump(mode="json", exclude_none=True)
        create_session(folder, Volume(title="Replayed", settings=settings))
        shooting = _shift(folder, pages)
        print(f"{pages} pages: {shooting['shot']:.0f} s shooting, {shooting['all']:.0f} s until all were judged")
        print(f"verify: {len(verify(folder).problems)} problems in {len(verify(folder).found)} files")
        start, count, differing = time.perf_counter(), 0, 0
        for one in replay(read_session(folder), Path(name) / "scratch"):
            count, differing = count + 1, differing + bool(one.differing)
            if one.differing:
                print(f"page {one.event.page}, {one.event.name}: {', '.join(one.differing)} differ")
        print(f"replay: {count} runs, {count - differing} equal; {time.perf_counter() - start:.0f} s")
    return 1 if differing else 0


def _shift(folder: Path, pages: int) -> dict[str, float]:
    """Shoot every page, one after the other; seconds until the last was stored, and until the last was judged."""
    start, seconds = time.perf_counter(), dict[str, float]()
    shots = iter(range(pages))
    with open_session(folder) as writer, background() as submit:
        shift = Shift(writer, lambda: _shot(next(shots)), submit, print)
        for _ in range(pages):
            shift.press("shoot")
        seconds["shot"] = time.perf_counter() - start
        shift.inbox.put("q")
        shift.run()
        seconds["all"] = time.perf_counter() - start
    return seconds


def _shot(number: int) -> RangeScan:
    scene = {"sheet": SHEETS[number % len(SHEETS)], "artwork": "text", "page_mm": [200, 150], "table": "dark"}
    config = {"driver": "simulated", "lens": "MIDDLE", "distance_mm": 900, "seed": number, "scene": scene}
    with drivers.open_scanner(config) as scanner:
        return scanner.capture(SETTINGS)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pages", type=int, default=20)
    sys.exit(main(parser.parse_args().pages))
