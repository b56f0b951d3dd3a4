"""`python -m bench.reproduce`: twenty small pages are restored, judged, and reproduced from their originals."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from restore import RangeScan
from station.capture_loop.loop import CaptureLoop
from station.run.small_page import small_page
from station.session import Volume, create_session, open_session, read_session
from station.session.derivation.reproduce import reproduce
from station.session.derivation.restoration import Run, run_restore
from station.session.terms.presets import Preset, load_preset

SETTINGS = {"points": 300, "dpi": 60}
THRESHOLDS = load_preset("book").thresholds


def main(pages: int) -> int:
    """Print a line for each run that came out otherwise, then how many did not. Returns 1 when one did."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "volume"
        preset = Preset(settings=SETTINGS, outputs=("coverage", "mesh", "tiff"), thresholds=THRESHOLDS)
        values = preset.model_dump(mode="json", exclude_none=True)
        create_session(folder, Volume(title="Reproduced", preset_values=values))
        scans = (_scan(number) for number in range(pages))
        with open_session(folder) as writer:
            loop = CaptureLoop(writer, lambda: next(scans), restore_now, lambda _line: None)
            for key in (*" " * pages, "q"):
                loop.inbox.put(key)
            loop.run()
        done = list(reproduce(read_session(folder), Path(name) / "scratch"))
    differing = [one for one in done if one.differing]
    for one in differing:
        print(f"page {one.event.page}, {one.event.name}: {', '.join(one.differing)} differ")
    files = sum(len(one.event.files) for one in done)
    print(f"{pages} pages, {len(done)} runs with {files} files: {len(done) - len(differing)} equal")
    return 1 if differing else 0


def _scan(number: int) -> RangeScan:
    """The small page with another print."""
    scan = small_page()
    texture = np.random.default_rng(number).integers(0, 256, (*scan.points.shape[:2], 3), np.uint8)
    return replace(scan, texture=texture)


def restore_now(source: Path, parameters: Mapping[str, Any], folder: Path) -> Future[Run]:
    """Restore a scan in this process. See `station.session.derivation.service.Submit`."""
    future: Future[Run] = Future()
    future.set_result(run_restore(source, parameters, folder))
    return future


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pages", type=int, default=20)
    sys.exit(main(parser.parse_args().pages))
