"""Restore all scans of a folder, and go on when one cannot be: `python examples/batch.py scans pages`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from PIL import Image

from restore import RestoreError, Settings, load_scan, restore


def main(scans: Path, pages: Path) -> int:
    """Write a page and a report for every scan; returns how many could not be restored."""
    pages.mkdir(parents=True, exist_ok=True)
    settings, failed = Settings(points=300, dpi=100), 0
    for path in sorted(scans.iterdir()):
        try:
            page = restore(load_scan(path), settings)
        except RestoreError as error:
            # The message says what is wrong, the hint what to do now.
            print(f"{path.name}: {error}; {error.hint}")
            failed += 1
            continue
        Image.fromarray(page.image).save(pages / f"{path.stem}.png", dpi=(page.dpi, page.dpi))
        (pages / f"{path.stem}.json").write_text(json.dumps(page.report, indent=1), "utf-8")
        print(f"{path.name}: rms strain {page.report['strain']['rms']:.2%}")
    return failed


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:3])) > 0)
