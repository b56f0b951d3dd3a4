"""`python -m bench.pages_per_hour`: a shift whose operator shoots as fast as the scanner allows.

The scanner's own time for a shot is that of the simulated device: focus, laser, colour image. A stand-in for the
scanner takes that long, without computing, and gives one of a few scans that were shot beforehand. Printed are pages to
the hour with the restorations in the background, beside what the scanner alone could do and what storing costs, and how
long after its shot a page is checked.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from itertools import cycle
from pathlib import Path

import numpy as np

from drivers.scsi.in_process import InProcess
from drivers.simulated import rig
from drivers.vivid900.capture.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.link import Link
from drivers.vivid900.settings import VividSettings
from restore import RangeScan
from station.capture_loop.loop import CaptureLoop, Message
from station.session import Volume, create_session, open_session
from station.session.derivation.restoration import run_restore
from station.session.terms.presets import load_preset
from station.workers.background import background

SHEETS = ({"name": "curl", "radius_mm": 200.0}, {"name": "wave"}, {"name": "cone"})
PAGE_MM = (150, 200)
HOUR_S = 3600.0
FIRST = 2  # pages before the process of the restorations has its kernels


def main() -> None:
    """Print pages to the hour, and the time from a shot to its verdict."""
    parser = argparse.ArgumentParser(prog="python -m bench.pages_per_hour", description=__doc__)
    parser.add_argument("--pages", type=int, default=20)
    pages = parser.parse_args().pages
    shots = [shot(sheet) for sheet in SHEETS]
    shot_s = float(np.median([seconds for _, seconds in shots]))
    started, verdicts = work([scan for scan, _ in shots], shot_s, pages)
    period = float(np.median(np.diff(started)[FIRST:]))
    print(f"{'the scanner alone':<34}{HOUR_S / shot_s:>8.0f} pages an hour, {shot_s:.2f} s a shot")
    print(f"{'a shift, storing and restoring':<34}{HOUR_S / period:>8.0f} pages an hour, {period:.2f} s a page")
    late = verdicts[FIRST:]
    print(f"from the end of a shot to its verdict: {np.median(late):.2f} s median, {max(late):.2f} s at most")


def shot(sheet: dict[str, object]) -> tuple[RangeScan, float]:
    """A FINE scan of a page of text, and how long the simulated scanner was busy with it, seconds of its own clock."""
    setup = rig({"driver": "simulated", "scene": {"sheet": sheet, "artwork": "text", "page_mm": PAGE_MM}})
    link = Link(InProcess(setup.device), None, setup.clock, setup.clock.sleep)
    with Vivid900(link, setup.device.profile, calibrations(None, lens=setup.device.lens.name)) as scanner:
        start = setup.clock()
        return scanner.capture(VividSettings()), setup.clock() - start


def work(scans: list[RangeScan], shot_s: float, pages: int) -> tuple[list[float], list[float]]:
    """When each shot began, and seconds from the end of each to its verdict."""
    source, started, ended, checked = cycle(scans), list[float](), list[float](), list[float]()

    def take() -> RangeScan:
        started.append(time.perf_counter())
        time.sleep(shot_s)
        ended.append(time.perf_counter())
        loop.inbox.put(" " if len(started) < pages else "q")  # behind the restorations that have ended meanwhile
        return next(source)

    def show(message: Message) -> None:
        if "checks" in message.text:
            checked.append(time.perf_counter())

    with tempfile.TemporaryDirectory() as name, background(run_restore) as submit:
        settings = load_preset("leaflet").model_dump(mode="json", exclude_none=True)
        create_session(Path(name) / "volume", Volume(title="A volume", preset_values=settings))
        with open_session(Path(name) / "volume") as writer:
            loop = CaptureLoop(writer, take, submit, show)
            loop.inbox.put(" ")
            loop.run()
    return started, [then - shot_end for then, shot_end in zip(checked, ended, strict=True)]


if __name__ == "__main__":
    main()
