"""Restore a page from photographs alone: `python examples/photographs.py page.png IMG_*.jpg`.

The photographs show the page on a table from all sides, with the scale card of `planish card` next to it; a video of it
serves as well. This needs the extra `photos`.
"""

from __future__ import annotations

import sys
from pathlib import Path

from PIL import Image

from restore import Settings, read_photographs, reconstruct_page, restore


def main(page_path: Path, *pictures: Path) -> None:
    """Reconstruct the surface of the page, restore it, painted from the photographs, and write it."""
    # 1. The surface and the cameras. The findings say how far the result is to be trusted.
    found = reconstruct_page(read_photographs(pictures))
    for finding in found.findings:
        print(f"{finding.severity}: {finding.text}")

    # 2. The surface is restored like any scan; the photographs that joined are its colour.
    page = restore(found.mesh, Settings(points=300, dpi=100), photos=found.photographs)
    Image.fromarray(page.image).save(page_path, dpi=(page.dpi, page.dpi))
    width, height = page.report["page_mm"]
    print(f"{width:.1f} × {height:.1f} mm from {len(found.photographs)} photographs")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
