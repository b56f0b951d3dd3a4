"""`python -m bench.book`: the shift of `planish demo --book`, compared with the truth of its volume.

Prints the table, the rows that differ from the expected ones, the errors of the sizes of all leaf sides, and the time.
Returns 1 when a row, the totals or a leaf side differs.
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np

from drivers.simulated.config import read
from oracles.book import BOOK, TOTALS, side_sizes
from station.capture_loop.demonstration import demonstrate, table, totals
from station.config import BOOK as NAME
from station.config import load_config
from station.session import Session, read_session
from station.session.leaves.leaf import leaves_of

MAX_SIZE_MM = 1.0  # of a leaf side in the fast mode, which has a sample each 1.2 mm


def main() -> int:
    """Work the shift, and compare."""
    station, start = load_config(Path(NAME)), perf_counter()
    with tempfile.TemporaryDirectory() as name:
        shift = demonstrate(Path(name), station, lambda _line: None)
        seconds = perf_counter() - start
        errors = _size_errors(read_session(Path(name) / "book"))
    print(table(shift))
    expected = [(row.number, row.lies, row.first, row.again) for row in BOOK]
    differ = [
        f"expected: {want}, got: {tuple(got)}"
        for want, got in zip(expected, shift.openings, strict=True)
        if want != tuple(got)
    ]
    last = totals(shift.openings, len(shift.files))
    differ += [f"expected: {TOTALS}"] if last != TOTALS else []
    print(*(differ or ["the table is the expected one"]), sep="\n")
    size = np.abs(list(errors.values()))
    worst = max(errors, key=lambda leaf: abs(errors[leaf]))
    print(f"sizes of {len(errors)} leaf sides: median {np.median(size):.2f}, worst {size.max():.2f} mm ({worst})")
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    captured, restored = (one.ru_utime + one.ru_stime for one in used)
    print(
        f"{seconds:.0f} s at a load of {os.getloadavg()[0]:.0f}; processor time: {captured:.0f} s of the simulated "
        f"scanner and the shift, {restored:.0f} s of restorations"
    )
    return int(bool(differ) or size.max() > MAX_SIZE_MM)


def _size_errors(session: Session) -> dict[str, float]:
    """Leaf side → the larger error of its width and height, mm; without the strip of the facing page."""
    openings, errors = read(load_config(Path(NAME)).scanner).book, {}
    for leaf in leaves_of(session):
        true = side_sizes(openings[leaf.page.number - 1], (leaf.part,))[leaf.part]
        found = leaf.report.get("leaf_mm", leaf.report["page_mm"])
        errors[leaf.name] = max((float(a - b) for a, b in zip(found, true, strict=True)), key=abs)
    return errors


if __name__ == "__main__":
    sys.exit(main())
