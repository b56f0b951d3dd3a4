"""`python -m bench.hostile_folder [--entries 300] [--seed S]`: a folder that a batch restores.

Good scans between files, folders, links and pipes that are damaged, endless, foreign, unreadable or badly named, all
by chance. `planish batch` is run twice. What must hold: it ends by itself with 0 or 7 both times, every good scan is
restored, and the second run restores and sets aside nothing more. With
`--without-privileges` a root user cannot read what its mode forbids, as any other user.
"""

from __future__ import annotations

import argparse
import json
import os
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random

from bench.watch import make_page
from restore.formats import SCAN_SUFFIXES
from station.errors import SET_ASIDE

ENTRIES, GOOD = 300, 0.15  # of the entries are good scans
LIMIT_S = 7200.0
LARGE_BYTES = 2**31 + 2**29  # of a file without contents
NAMES = ("page", "Seite 12", "ページ", "-rf", "a" * 240, "e\u0301tude", "x\ny", "\x1b[2J", "%s", "con", "report.html")
QUICK = ("--points", "100", "--dpi", "40")
BARE = "setpriv", "--bounding-set", "-all", "--inh-caps", "-all"
Entry = Callable[[Path, Random], object]
"""Makes an entry at a path without an ending, or with one of its own."""


def main(entries: int = ENTRIES, seed: int | None = None, *, without_privileges: bool = False) -> int:
    """Print what came of both runs. Returns 1 when something that must hold does not."""
    seed = secrets.randbits(32) if seed is None else seed
    rng, start = Random(seed), time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        folder, out = Path(name) / "in", Path(name) / "out"
        folder.mkdir()
        kinds, good = make_folder(folder, Path(name) / "made", entries, rng)
        print(f"{entries} entries, seed {seed}: {len(good)} good scans, {dict(kinds)}", flush=True)
        before = BARE if without_privileges else ()
        runs = [_batch(folder, out, before) for _ in range(2)]
        missing = [path for path in good if not _is_restored(path.relative_to(folder), out)]
        for path in folder.rglob("*"):  # so that the folder can be removed
            if path.is_dir() and not path.is_symlink():
                path.chmod(0o700)
    for code, counts, said in runs:
        print(f"exit code {code}: {counts}; {said[:2]}")
    print(f"good scans without a result: {[str(path) for path in missing]}; {time.perf_counter() - start:.0f} s")
    again = sum(runs[1][1].get(state, 0) for state in ("restored", "set aside"))
    return int(bool(missing) or again > 0 or any(code not in (0, SET_ASIDE) for code, _, _ in runs))


def make_folder(folder: Path, made: Path, entries: int, rng: Random) -> tuple[Counter[str], list[Path]]:
    """Fill a folder. Returns the counts of each kind, and the good scans.

    made: a folder for the originals.
    """
    made.mkdir()
    kinds, good = Counter[str](), list[Path]()
    places = [folder]
    for number in range(entries):
        place = rng.choice(places)
        name = rng.choice((f"{number:03d}", f"{number:03d}-{rng.choice(NAMES)}"))[:240]
        if rng.random() < GOOD:
            good.append(_good(place, name, made, number, rng))
            kinds["good"] += 1
            continue
        kind = rng.choice(list(KINDS))
        KINDS[kind](place / name, rng)
        kinds[kind] += 1
        if kind == "folder":
            places.append(_with(place / name, ""))
    return kinds, good


def _good(place: Path, name: str, made: Path, number: int, rng: Random) -> Path:
    """Copy a small page under a name that may be odd, with its material and its picture."""
    page = make_page(made, number)
    ending = page.suffix if rng.random() < 0.8 else page.suffix.upper()
    for other in made.glob(f"{page.stem}.*"):
        if other != page:
            shutil.copy(other, place)
    target = place / (name.replace("/", "-").encode()[:200].decode("utf-8", "ignore") + ending)
    shutil.copy(page, target)
    return target


def _ending(rng: Random) -> str:
    return rng.choice(SCAN_SUFFIXES)


def _write(path: Path, data: bytes) -> None:
    path.with_name(path.name[:200]).write_bytes(data)


def _with(path: Path, ending: str) -> Path:
    return path.with_name(path.name.encode()[:200].decode("utf-8", "ignore") + ending)


def _mesh(line: str) -> bytes:
    return f"{line}\nv 0 0 0\nv 9 0 0\nv 0 9 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n".encode()


def _cycle(path: Path, rng: Random) -> None:
    """A mesh whose material file names itself, or two that name each other."""
    own, other = _with(path, ".mtl"), _with(path, rng.choice((".mtl", "-2.mtl")))
    for one, next_one in ((own, other), (other, own)):
        one.write_text(f"map_Kd {next_one.name}\n")
    _with(path, ".obj").write_bytes(_mesh(f"mtllib {own.name}"))


def _nested(path: Path, _rng: Random) -> None:
    """A mesh next to a folder of its picture's name that holds another mesh."""
    stem = _with(path, "").name
    inner = path.parent / stem / f"{stem}.png"
    inner.mkdir(parents=True)
    (inner / f"{stem}.obj").write_bytes(_mesh("#"))
    _with(path, ".obj").write_bytes(_mesh("#"))


def _large(path: Path, rng: Random) -> None:
    with _with(path, _ending(rng)).open("wb") as file:
        file.truncate(LARGE_BYTES)


def _forbidden(path: Path, rng: Random) -> None:
    target = _with(path, _ending(rng))
    target.write_bytes(_mesh("#"))
    target.chmod(0)


def _closed_folder(path: Path, _rng: Random) -> None:
    path = _with(path, "")
    path.mkdir()
    (path / "page.obj").write_bytes(_mesh("#"))
    path.chmod(0)


def _deep(path: Path, rng: Random) -> None:
    inner = _with(path, "").joinpath(*"abcdefghijklmnopqrst")
    inner.mkdir(parents=True)
    (inner / f"page{_ending(rng)}").write_bytes(rng.randbytes(99))


def _socket(path: Path, rng: Random) -> None:
    with socket.socket(socket.AF_UNIX) as made:
        here = Path.cwd()
        os.chdir(path.parent)  # the path of a socket may have 108 bytes
        try:
            made.bind(f"{path.name.encode()[:20].decode('utf-8', 'ignore')}{_ending(rng)}")
        finally:
            os.chdir(here)


def _link(to: Callable[[Path], str], path: Path, rng: Random) -> None:
    target = _with(path, _ending(rng))
    target.symlink_to(to(target))


KINDS: dict[str, Entry] = {
    "empty": lambda path, rng: _with(path, _ending(rng)).touch(),
    "noise": lambda path, rng: _with(path, _ending(rng)).write_bytes(rng.randbytes(rng.randrange(1, 5000))),
    "one byte": lambda path, rng: _with(path, _ending(rng)).write_bytes(rng.randbytes(1)),
    "cut short": lambda path, rng: _with(path, ".obj").write_bytes(_mesh("#")[: rng.randrange(2, 50)]),
    "cycle": _cycle,
    "foreign": lambda path, rng: _with(path, ".obj").write_bytes(
        _mesh("mtllib " + rng.choice(("/etc/passwd", "../../x.mtl", "C:\\x.mtl", "gone.mtl", "")))
    ),
    "nested": _nested,
    "large": _large,
    "forbidden": _forbidden,
    "closed folder": _closed_folder,
    "folder": lambda path, _rng: _with(path, "").mkdir() or path.with_name(_with(path, "").name),
    "folder as file": lambda path, rng: _with(path, _ending(rng)).mkdir(),
    "scan folder": lambda path, rng: (
        _with(path, ".scan").mkdir(),
        (_with(path, ".scan") / "scan.json").write_bytes(rng.randbytes(9)),
        (_with(path, ".scan") / "points.npz").write_bytes(rng.randbytes(9)),
    ),
    "deep": _deep,
    "pipe": lambda path, rng: os.mkfifo(_with(path, _ending(rng))),
    "socket": _socket,
    "link to nothing": lambda path, rng: _link(lambda _: "gone", path, rng),
    "link to itself": lambda path, rng: _link(lambda own: own.name, path, rng),
    "link to a folder": lambda path, rng: _link(lambda _: "/", path, rng),
    "link to a device": lambda path, rng: _link(lambda _: "/dev/zero", path, rng),
    "link outside": lambda path, rng: _link(lambda _: "/etc/passwd", path, rng),
    "no text": lambda path, rng: Path(
        os.fsdecode(os.fsencode(_with(path, "")) + b"\xff\xfe" + _ending(rng).encode())
    ).touch(),
    "picture": lambda path, rng: _with(path, rng.choice((".png", ".jpg", ".tif"))).write_bytes(rng.randbytes(50)),
    "hidden": lambda path, rng: path.with_name(f".{_with(path, '').name}{_ending(rng)}").write_bytes(b"#"),
}


def _is_restored(scan: Path, out: Path) -> bool:
    """Whether a report in the results names the scan, as it names one that was restored."""
    for report in (out / scan.parent).rglob("*.json"):
        try:
            if json.loads(report.read_bytes())["arrival"]["scan"] == str(scan):
                return True
        except (ValueError, KeyError, TypeError):
            continue
    return False


def _batch(folder: Path, out: Path, before: tuple[str, ...]) -> tuple[int, dict[str, int], list[str]]:
    """The exit code of `planish batch`, how many scans are in each state, and its messages."""
    start = "import sys; from station.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [*before, sys.executable, "-c", start, "batch", str(folder), "-o", str(out), *QUICK, "--json"]
    run = subprocess.run(command, capture_output=True, timeout=LIMIT_S, check=False)
    lines = run.stdout.decode("utf-8", "replace").splitlines()
    counts = json.loads(lines[-1]).get("counts", {}) if lines else {}
    return run.returncode, counts, run.stderr.decode("utf-8", "replace").splitlines()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--entries", type=int, default=ENTRIES)
    parser.add_argument("--seed", type=int, help="of an earlier run; a fresh one by default")
    parser.add_argument("--without-privileges", action="store_true", help="run the batch by setpriv, as root")
    options = parser.parse_args()
    sys.exit(main(options.entries, options.seed, without_privileges=options.without_privileges))
