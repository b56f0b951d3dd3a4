"""`python -m oracles.console.volume FOLDER`: the console before the simulated Vivid 900 and a printed volume.

Driver, device and optics are those of `driver = "simulated"`; after each FINE shot a leaf is turned. The third page
reaches out of the picture. Which is next stands in a file, so that a server that was killed goes on. Prints its link.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drivers import open_scanner
from drivers.scanner import Progress
from drivers.vivid900.settings import VividSettings
from restore import RangeScan
from station.config import StationConfig
from station.console.serving import Address, serve
from station.console.state.app_state import AppState

NEXT = "next-shot"
LENS, DISTANCE_MM = "TELE", 900.0
PAGE_MM = (150.0, 108.0)  # fills the picture of this lens
SHIFTED, SHIFT_MM = 2, 24.0  # which shot, and how far beside the middle its page lies: it reaches out of the picture
SIZES_PT = (12.0, 10.0)
TABLE: Mapping[str, Any] = {"driver": "simulated", "lens": LENS, "distance_mm": DISTANCE_MM}


class VolumeScanner:
    """A scanner under which leaves are turned."""

    def __init__(self, folder: Path) -> None:
        self._next = folder / NEXT
        with open_scanner(TABLE) as scanner:
            self.identity = str(getattr(scanner, "identity", TABLE["driver"]))

    def capture(self, settings: VividSettings, progress: Progress = lambda _step, _done: None) -> RangeScan:
        """The page that lies open; a preview, which is FAST, turns no leaf."""
        number = int(self._next.read_text()) if self._next.exists() else 0
        if settings.mode == "fine":
            self._next.write_text(str(number + 1))
        with open_scanner({**TABLE, "seed": number, "scene": scene(number)}) as scanner:
            return scanner.capture(settings, progress)

    def close(self) -> None:
        """Nothing is held between two shots."""

    def __enter__(self) -> VolumeScanner:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def scene(number: int) -> dict[str, Any]:
    """The table `[scanner.scene]` of a page of the volume."""
    artwork = {"name": "text", "seed": number, "title_pt": 18.0, "sizes_pt": SIZES_PT, "margin_mm": 9.0}
    pose = {"shift_mm": (SHIFT_MM if number == SHIFTED else 0.0, 0.0, 0.0)}
    return {"sheet": "binding", "page_mm": PAGE_MM, "artwork": {**artwork, "columns": 1 + number % 2}, "pose": pose}


def main(folder: Path) -> int:
    """Serve until a signal ends it."""
    app_state = AppState(folder, StationConfig(scanner=dict(TABLE)), open_scanner=lambda _table: VolumeScanner(folder))
    serve(app_state, Address(port=0), show=lambda link: print(link, flush=True))
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
