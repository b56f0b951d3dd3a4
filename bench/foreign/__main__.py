"""`python -m bench.foreign [--cases 1000] [--seed S] [--family NAME]`: other people's files, and what came of each.

A page is right where its size and its picture are those that were drawn. What must hold: no page is wrong without a
finding, and no page whose texture map runs as its faces do is said to be mirrored.
"""

from __future__ import annotations

import argparse
import secrets
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from random import Random

import cv2
import numpy as np

from bench.foreign.families import FAMILIES
from bench.foreign.page import Case
from bench.foreign.write import write
from restore import RestoredPage, RestoreError, Settings, load_scan, restore
from restore.scan import Bytes

CASES = 1000
DPI = 60.0
SIZE = 0.01  # of a side: a page of other size is wrong
MIN_ALIKE = 0.8  # correlation with the picture that was drawn: letters are averaged, discs are not
KINDS = ("right", "right, said", "wrong, said", "refused", "WRONG, SILENT", "FALSE MIRROR")


def outcome(case: Case, path: Path) -> tuple[str, str]:
    """What came of a case, one of KINDS, and what was said of it."""
    try:
        page = restore(load_scan(path, unit="10um" if path.is_dir() else "auto"), Settings(dpi=DPI))
    except RestoreError as error:
        return "refused", str(error)
    said = [one.text for one in page.findings]
    right = is_right(case, page)
    if "mirrored" in [one.code for one in page.findings] and not case.mirrored:
        return "FALSE MIRROR", "; ".join(said)
    what = f"{page.report['page_mm']} for {case.flat_mm}; " + "; ".join(said)
    if right:
        return ("right, said" if said else "right"), what
    return ("wrong, said" if said else "WRONG, SILENT"), what


def is_right(case: Case, page: RestoredPage) -> bool:
    """Whether a restored page has the size and the picture of the one that was drawn."""
    apart = np.abs(np.array(page.report["page_mm"]) / case.flat_mm - 1.0)
    if apart.max() >= SIZE:
        return False
    return "writer" in case.notes or alike(page.image, case.shown) > MIN_ALIKE  # a segment has no picture


def alike(image: Bytes, shown: Bytes) -> float:
    """The correlation of a page with the picture that it should show."""
    small = [cv2.resize(one, (90, 60), interpolation=cv2.INTER_AREA).astype(float).ravel() for one in (image, shown)]
    return float(np.corrcoef(*small)[0, 1])


def main(cases: int, seed: int | None, family: str | None, first: int = 0) -> int:
    """Print a line for each family. Returns 1 when a page was wrong and nothing was said, or falsely said."""
    seed = secrets.randbits(32) if seed is None else seed
    print(f"{cases} cases, seed {seed}", flush=True)
    found, start = {name: Counter[str]() for name in FAMILIES}, time.perf_counter()
    for k in range(first, first + cases):
        rng = Random(f"{seed} {k}")
        name = family or list(FAMILIES)[k % len(FAMILIES)]
        with tempfile.TemporaryDirectory() as folder:
            case = FAMILIES[name](rng)
            kind, path = write(case, Path(folder), rng)
            what, said = outcome(case, path)
        found[name][what] += 1
        if what.isupper() or what.startswith("WRONG"):
            print(f"  {what}: {name} {kind} (--seed {seed} --first {k} --cases 1) {said}", flush=True)
    print(f"{'family':<14}" + "".join(f"{kind:>15}" for kind in KINDS))
    for name, counts in found.items():
        print(f"{name:<14}" + "".join(f"{counts[kind]:>15}" for kind in KINDS))
    print(f"{time.perf_counter() - start:.0f} s")
    return int(any(counts[kind] for counts in found.values() for kind in KINDS[-2:]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=CASES)
    parser.add_argument("--seed", type=int, help="of an earlier run; a fresh one by default")
    parser.add_argument("--family", choices=list(FAMILIES))
    parser.add_argument("--first", type=int, default=0, help="number of the first case: finds one again")
    options = parser.parse_args()
    sys.exit(main(options.cases, options.seed, options.family, options.first))
