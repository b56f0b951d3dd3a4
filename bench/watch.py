"""`python -m bench.watch`: some 200 scans arrive in a folder in every way, good and bad, while it is watched.

They grow for seconds, come by rename and by copy, in halves, twice, damaged, empty, before and after their pictures,
and some vanish; the watch is interrupted and started again meanwhile. What must hold: each scan is restored once or
set aside once, nothing in the watched folder has changed, nothing half done is left.
"""

from __future__ import annotations

import argparse
import filecmp
import random
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from heapq import heappop, heappush
from itertools import count, islice, pairwise
from pathlib import Path

import numpy as np

from drivers.simulated.scene.sheets import Curl
from oracles.exact import exact_sheet
from restore import Settings, SurfaceMesh
from restore.formats import write_obj, write_ply
from station.intake.loop import Pace, Watch
from station.intake.presets import Presets
from station.run.one_page import Destination, restore_file
from station.run.options import RunOptions

ARRIVALS, INTERRUPTIONS, SEED = 200, 5, 1
PACE = Pace(poll_s=0.2, settle_s=2.0, pair_s=8.0)
GROWTH_S, PIECES = 3.0, 12  # of a file that grows: each piece comes well before it counts as complete
LATER_S = PACE.settle_s + 3.0  # when the watch has taken a first half for the whole
BETWEEN_S = 0.15  # from one arrival to the next
MESH_POINTS, TEXTURE = 150, (60, 80, 3)
QUICK = RunOptions(Settings(points=100, dpi=40))

Action = Callable[[], object]
Steps = Iterator[tuple[float, Action]]
"""Seconds after the arrival's beginning → what happens then."""


@dataclass(frozen=True)
class Parcel:
    """The files of one scan outside the watched folder, and where they are to arrive."""

    made: Path
    to: Path

    @property
    def companions_of_scan(self) -> list[Path]:
        """The files that belong to the scan."""
        return [path for path in self.made.parent.glob(f"{self.made.stem}.*") if path != self.made]

    def put(self, path: Path) -> None:
        """Copy one of the files to where it arrives."""
        shutil.copy2(path, self.to / path.name)

    def write(self, data: bytes, mode: str = "wb") -> None:
        """Write the scan itself, or a part of it."""
        with (self.to / self.made.name).open(mode) as file:
            file.write(data)

    def companions(self) -> Steps:
        """All files but the scan, at once."""
        for path in self.companions_of_scan:
            yield 0.0, lambda path=path: self.put(path)  # type: ignore[misc]


def copied(parcel: Parcel) -> Steps:
    yield from parcel.companions()
    yield 0.0, lambda: parcel.put(parcel.made)


def renamed(parcel: Parcel) -> Steps:
    yield from parcel.companions()
    hidden = parcel.to / f".{parcel.made.name}.part"
    yield 0.0, lambda: shutil.copy2(parcel.made, hidden)
    yield 1.0, lambda: hidden.rename(parcel.to / parcel.made.name)


def picture_late(parcel: Parcel) -> Steps:
    yield 0.0, lambda: parcel.put(parcel.made)
    for _, action in parcel.companions():
        yield LATER_S, action


def growing(parcel: Parcel) -> Steps:
    yield from parcel.companions()
    data = parcel.made.read_bytes()
    cuts = [len(data) * step // PIECES for step in range(PIECES + 1)]
    for step, (start, end) in enumerate(pairwise(cuts)):
        part = data[start:end]
        yield GROWTH_S * step / PIECES, lambda part=part: parcel.write(part, "ab")  # type: ignore[misc]


def halves(parcel: Parcel) -> Steps:
    yield from half(parcel)
    rest = parcel.made.read_bytes()
    yield 2 * LATER_S, lambda: parcel.write(rest[len(rest) // 2 :], "ab")


def half(parcel: Parcel) -> Steps:
    yield from parcel.companions()
    data = parcel.made.read_bytes()
    yield 0.0, lambda: parcel.write(data[: len(data) // 2])


def twice(parcel: Parcel) -> Steps:
    yield from copied(parcel)
    yield 2 * LATER_S, lambda: parcel.write(parcel.made.read_bytes())


def damaged(parcel: Parcel) -> Steps:
    yield from parcel.companions()
    noise = random.Random(parcel.made.name).randbytes(parcel.made.stat().st_size)
    yield 0.0, lambda: parcel.write(noise)


def empty(parcel: Parcel) -> Steps:
    yield from parcel.companions()
    yield 0.0, lambda: parcel.write(b"")


def vanishing(parcel: Parcel) -> Steps:
    yield from copied(parcel)
    yield 0.5, lambda: (parcel.to / parcel.made.name).unlink()


# Ways that end with the scan as it was made.
WHOLE = ("copied", "renamed", "picture_late", "growing", "halves", "twice")
# Way → times that it is restored and set aside. A first half may be taken for a damaged scan before the rest comes.
WAYS: dict[Callable[[Parcel], Steps], tuple[range, range]] = {
    copied: (range(1, 2), range(1)),
    renamed: (range(1, 2), range(1)),
    picture_late: (range(1, 2), range(1)),
    growing: (range(1, 2), range(1)),
    halves: (range(1, 2), range(2)),
    twice: (range(1, 2), range(1)),
    half: (range(1), range(1, 2)),
    damaged: (range(1), range(1, 2)),
    empty: (range(1), range(1, 2)),
    vanishing: (range(1), range(1)),
}


@dataclass
class Rig:
    """A watched folder with arrivals on their way to it."""

    root: Path
    folder: Path = field(init=False)
    out: Path = field(init=False)
    ways: dict[str, Callable[[Parcel], Steps]] = field(default_factory=dict)
    counts: dict[str, Counter[str]] = field(default_factory=dict)
    steps: list[tuple[float, int, Action]] = field(default_factory=list)
    starts: int = 0

    def __post_init__(self) -> None:
        self.folder, self.out = self.root / "in", self.root / "out"
        (self.root / "made").mkdir()
        order = count()
        for index, way in enumerate(islice(_cycle(), ARRIVALS)):
            sub = self.folder / ("", "a", "b/c")[index % 3]
            sub.mkdir(parents=True, exist_ok=True)
            parcel = Parcel(make_page(self.root / "made", index), sub)
            self.ways[str((sub / parcel.made.name).relative_to(self.folder))] = way
            for after, action in way(parcel):
                heappush(self.steps, (index * BETWEEN_S + after, next(order), action))

    def deliver(self) -> None:
        """Let everything arrive in its time, and interrupt the watch now and then."""
        start, rng = time.monotonic(), random.Random(SEED)
        last = max(self.steps)[0]
        for _ in range(INTERRUPTIONS):
            moment = rng.uniform(0, last)
            heappush(self.steps, (moment, -1, lambda: signal.raise_signal(signal.SIGINT)))
        while self.steps:
            due, _, action = heappop(self.steps)
            time.sleep(max(0.0, start + due - time.monotonic()))
            action()

    def watch(self) -> None:
        """Start a watch; it ends when nothing is waited for, or is interrupted."""
        self.starts += 1
        Watch(self.folder, self.out, Presets(self.folder, QUICK), restore_file, self._note, PACE, once=True).run()

    def watch_all(self) -> None:
        """Watch, starting again after every interruption, until everything has arrived and is done.

        The kernels are compiled before: otherwise everything has arrived by then.
        """
        restore_file(next((self.root / "made").glob("*.obj")), Destination(self.root / "first"), QUICK)
        courier = threading.Thread(target=self.deliver)
        courier.start()
        while courier.is_alive():
            with suppress(KeyboardInterrupt):
                self.watch()
                courier.join(PACE.poll_s)
        self.watch()

    def _note(self, event: str, path: Path, _text: str) -> None:
        self.counts.setdefault(str(path), Counter())[event] += 1

    def results(self, name: str) -> int:
        """The number of results of a scan."""
        return len(list((self.out / Path(name).parent).glob(f"{Path(name).stem}*/*.png")))

    def violations(self) -> Iterator[str]:
        """What does not hold in the end."""
        for name, way in self.ways.items():
            counts, results = self.counts.get(name, Counter()), self.results(name)
            restored, aside = WAYS[way]
            if results not in restored or counts["set aside"] not in aside:
                yield f"{way.__name__} {name}: {results} results, {dict(counts)}"
            if way.__name__ in WHOLE and not filecmp.cmp(
                self.folder / name, self.root / "made" / Path(name).name, False
            ):
                yield f"{way.__name__} {name}: the original has changed"
            if counts["restored"] > results:
                yield f"{way.__name__} {name}: {counts['restored']} times notified of {results} results"
            note = self.out / "failed" / f"{name}.txt"
            if note.exists() != (aside.start == 1):
                yield f"{way.__name__} {name}: a note is {'there' if note.exists() else 'missing'}"
        silent = sum(self.results(name) - self.counts.get(name, Counter())["restored"] for name in self.ways)
        if silent > INTERRUPTIONS:  # one may fall between the results and the word of them
            yield f"nobody was notified of {silent} results"
        yield from (f"left: {path}" for path in self.out.rglob(".*"))
        yield from (f"left: {path}" for path in self.out.rglob("*.attempt"))


def _cycle() -> Iterator[Callable[[Parcel], Steps]]:
    ways = list(WAYS)
    rng = random.Random(SEED)
    while True:
        rng.shuffle(ways)
        yield from ways


def make_page(folder: Path, index: int) -> Path:
    """A small scan of its own: OBJ with material and picture, or binary PLY with a picture."""
    mesh = exact_sheet(Curl(), MESH_POINTS, seed=index).mesh
    rng = np.random.default_rng(index)
    low = mesh.vertices[:, :2].min(axis=0)
    share = (mesh.vertices[:, :2] - low) / (mesh.vertices[:, :2].max(axis=0) - low)
    texcoords = share * (TEXTURE[1] - 1, TEXTURE[0] - 1)
    mesh = SurfaceMesh(mesh.vertices, mesh.faces, texcoords, rng.integers(0, 256, TEXTURE, np.uint8))
    path = folder / f"page{index:03}.{('obj', 'ply')[index % 2]}"
    (write_obj, write_ply)[index % 2](mesh, path)
    return path


def _files(folder: Path) -> dict[Path, tuple[bytes, int]]:
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.rglob("*") if path.is_file()}


def main() -> int:
    """Print what came of each way to arrive, then the violations. Returns 1 when there was one."""
    parser = argparse.ArgumentParser(prog="python -m bench.watch", description=__doc__)
    parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a run in the background of a script ignores Ctrl-C
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as root:
        rig = Rig(Path(root))
        rig.watch_all()
        before = _files(rig.folder)
        known = {name: counts.copy() for name, counts in rig.counts.items()}
        rig.watch()  # another start has nothing to do
        violations, results_of = list(rig.violations()), {name: rig.results(name) for name in rig.ways}
        violations += ["the watched folder has changed"] if _files(rig.folder) != before else []
        violations += ["a new start did something again"] if known != rig.counts else []
    print(f"{len(rig.ways)} arrivals, {rig.starts} starts, {time.monotonic() - start:.0f} s")
    print("| arrival | scans | restored | set aside |\n|---|---|---|---|")
    for way in WAYS:
        names = [name for name, its in rig.ways.items() if its is way]
        results = sum(results_of[name] for name in names)
        aside = sum(rig.counts.get(name, Counter())["set aside"] for name in names)
        print(f"| {way.__name__.replace('_', ' ')} | {len(names)} | {results} | {aside} |")
    print(*violations, f"violations: {len(violations)}", sep="\n")
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main())
