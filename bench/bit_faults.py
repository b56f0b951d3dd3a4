"""`python -m bench.bit_faults`: single faults of the files of a session and of its exports, which `verify` must find.

A bit flipped, an end cut off, a file deleted, added or renamed. Where a problem has a remedy, `repair` has to bring
back the session to the byte. Of an export the problem has to name the page of the file.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from bench.scratch import scratch_folder
from oracles.file_faults import KINDS, file_fault
from oracles.tiny_scan import tiny_scan
from restore import BadInput
from station.archive.check import check_export
from station.archive.check import page_of as export_page_of
from station.archive.deliver import deliver
from station.archive.formats import Format
from station.archive.from_session import volume_of
from station.images.image_metadata import ImageMetadata
from station.images.png import encode_png
from station.session import Event, Session, Volume, add_scan, create_session, open_session, read_session
from station.session.derivation.restoration import PAGE, Run
from station.session.fixity.repair import repair
from station.session.fixity.verify import page_of, verify
from station.session.log.steps import decide, record_run

PAGES = 10
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
EXPORTS = (Format.BAGIT, Format.METS, Format.IIIF, Format.PDF, Format.TIFF)
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
        for format_ in EXPORTS:
            deliver(volume_of(read_session(session)), format_, scratch / format_, now=NOON)
            wrong += _export_faults(scratch / format_, faults // len(EXPORTS), random)
    return 1 if wrong else 0


def _export_faults(folder: Path, faults: int, random: np.random.Generator) -> int:
    """Print a line for an export. Returns the number of faults that were not found, or not on the page of the file."""
    found = named = 0
    for number in range(faults):
        with file_fault(folder, KINDS[number % len(KINDS)], random) as fault:
            try:
                pages = {problem.page for problem in check_export(folder, workers=2)}
            except BadInput:  # without its manifest it is no export, which is said
                pages = {0}
            found += bool(pages)
            named += export_page_of(fault.path) in pages
    files = sum(path.is_file() for path in folder.rglob("*"))
    print(ROW.format(folder.name, faults, found, named, "", "") + f"   {files} files", flush=True)
    return 2 * faults - found - named


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
            (made / PAGE).write_bytes(_made(page))
            record_run(writer, "restore", capture, parameters={"page": page}, result={}, files=made)
            decide(writer, "label", f"{page}r", page=page)
        add_scan(writer, tiny_scan(99), page=3, facts={})


def _derive(_session: Session, event: Event, folder: Path) -> Run:
    (folder / PAGE).write_bytes(_made(event.facts["parameters"]["page"]))
    return Run({})


def _made(page: int) -> bytes:
    """A page of noise as PNG."""
    return encode_png(
        np.random.default_rng(page).integers(0, 256, (20, 30, 3), np.uint8), 150.0, ImageMetadata.from_provenance({})
    )


def _tree(folder: Path) -> Tree:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", type=int, default=2500)
    sys.exit(main(parser.parse_args().faults))
