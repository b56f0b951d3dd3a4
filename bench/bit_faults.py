"""`python -m bench.bit_faults`: single faults of a session's files, each of which `verify` has to find and to name.

A bit flipped, an end cut off, a file deleted, added or renamed. Where a problem has a remedy, `repair` has to bring
back the session to the byte.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

from bench.scratch import scratch_folder
from oracles.file_faults import KINDS, file_fault
from oracles.tiny_scan import tiny_scan
from station.session import Event, Session, Volume, add_scan, create_session, decide, open_session, record_run
from station.session.repair import repair
from station.session.stages import Run
from station.session.verify import page_of, verify

PAGES = 10
ROW = "{:<8}{:>8}{:>8}{:>8}{:>11}{:>11}"
Tree = dict[str, bytes]


def main(faults: int) -> int:
    """Print a line for each kind of fault. Returns 1 when one was not found, was named wrongly or not mended."""
    start, random = time.perf_counter(), np.random.default_rng(1)
    wrong = 0
    print(ROW.format("fault", "tried", "found", "named", "mendable", "mended"))
    with scratch_folder() as scratch:
        session = scratch / "volume"
        _fill(session)
        before = _tree(session)
        for kind in KINDS:
            counts = Counter[str]()
            for _ in range(faults // len(KINDS)):
                counts.update(_try(session, kind, random, before))
            columns = [counts[column] for column in ("tried", "found", "named", "mendable", "mended")]
            print(ROW.format(kind, *columns), flush=True)
            wrong += 3 * counts["tried"] - sum(columns[:3]) + counts["mendable"] - counts["mended"]
    print(f"{len(before)} files; {time.perf_counter() - start:.0f} s")
    return 1 if wrong else 0


def _try(session: Path, kind: str, random: np.random.Generator, before: Tree) -> Counter[str]:
    """What came of one fault."""
    with file_fault(session, kind, random) as fault:
        problems = verify(session, workers=2).problems
        counts = Counter(tried=1, found=bool(problems))
        counts["named"] = {problem.page for problem in problems} == {page_of(fault.path)}
        if all(problem.remedy for problem in problems):
            counts["mendable"] = 1
            repair(session, derivers={"restore": _derive})
            counts["mended"] = _tree(session) == before
    for aside in session.parent.glob("volume.set-aside*"):
        shutil.rmtree(aside)
    return counts


def _fill(folder: Path) -> None:
    """A session of PAGES pages, each with a scan, a run and a label; one shot twice, one decision undone."""
    create_session(folder, Volume(title="A volume", project="bench"))
    with open_session(folder) as writer:
        for page in range(1, PAGES + 1):
            capture = add_scan(writer, tiny_scan(page), facts={})
            made = writer.staging("run")
            made.mkdir()
            (made / "page.bin").write_bytes(_made(page))
            record_run(writer, "restore", capture, parameters={"page": page}, result={}, files=made)
            decide(writer, "label", f"{page}r", page=page)
        add_scan(writer, tiny_scan(99), page=3, facts={})


def _derive(_session: Session, event: Event, folder: Path) -> Run:
    (folder / "page.bin").write_bytes(_made(event.facts["parameters"]["page"]))
    return Run({})


def _made(page: int) -> bytes:
    return np.random.default_rng(page).bytes(2000)


def _tree(folder: Path) -> Tree:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", type=int, default=2500)
    sys.exit(main(parser.parse_args().faults))
