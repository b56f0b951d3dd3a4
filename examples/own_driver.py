"""A driver of one's own, for any range camera that writes arrays: `python examples/own_driver.py shots`.

Every file NAME.npz has `points` (rows, cols, 3) mm and `colour` (rows, cols, 3) uint8 RGB.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from drivers import CaptureSettings, SettingsError
from restore import RangeScan, Settings, restore


class FolderScanner:
    """A scanner, as `drivers.Scanner` describes one, whose shots lie in a folder and are taken in order of name."""

    def __init__(self, folder: Path) -> None:
        self._shots = iter(sorted(folder.glob("*.npz")))

    def capture(self, settings: CaptureSettings, progress: object = None) -> RangeScan:  # noqa: ARG002
        """The next shot. Raises SettingsError when there is none."""
        path = next(self._shots, None)
        if path is None:
            raise SettingsError("there is no further shot in the folder", "copy another one into it")
        with np.load(path) as arrays:
            points, colour = arrays["points"].astype(float), arrays["colour"]
        # Every sample has the pixel of its own row and column. X is right, Y up, the page at negative Z.
        rows, cols = np.indices(points.shape[:2])
        return RangeScan(points, colour, np.dstack([cols, rows]).astype(float), {"device": "folder", "file": path.name})

    def close(self) -> None:
        """Nothing is left open between shots."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def main(folder: Path) -> None:
    """Capture one shot and restore its page."""
    with FolderScanner(folder) as scanner:
        scan = scanner.capture(CaptureSettings())
    page = restore(scan, Settings(points=300, dpi=100))
    width, height = page.report["page_mm"]
    print(f"{scan.provenance['file']}: {width:.1f} × {height:.1f} mm")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
