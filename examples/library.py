"""Restore one page with the library: `python examples/library.py page.obj page.png`."""

from __future__ import annotations

import sys
from pathlib import Path

from PIL import Image

from restore import Settings, load_scan, restore


def main(scan_path: Path, page_path: Path) -> None:
    """Read a scan, restore its page at 150 dpi and write it with its true resolution."""
    # 1. A scan is a range image or a mesh; load_scan tells them apart by the file.
    scan = load_scan(scan_path)

    # 2. Settings are the options of the command line. 300 points are enough for a page without creases.
    page = restore(scan, Settings(points=300, dpi=150))

    # 3. The page is an array (h, w, 3) uint8 RGB; at page.dpi it prints in its old size.
    Image.fromarray(page.image).save(page_path, dpi=(page.dpi, page.dpi))

    # 4. The report says how far the surface had to be strained, and what the source resolves.
    width, height = page.report["page_mm"]
    print(f"{width:.1f} × {height:.1f} mm, rms strain {page.report['strain']['rms']:.2%}")
    ppi = page.report["resolved_ppi"]
    print(f"the source resolves {ppi:.0f} pixels per inch" if ppi else "what the source resolves cannot be measured")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:3]))
