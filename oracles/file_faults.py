"""Single faults of files: a bit flipped, an end cut off, a file deleted, added or renamed; each can be taken back."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

KINDS = ("flip", "cut", "delete", "add", "rename")


@dataclass(frozen=True)
class FileFault:
    """A fault of one file. path: of the file, relative to the folder; of an added one, where it is put."""

    kind: str
    path: str
    detail: str


@contextmanager
def file_fault(folder: Path, kind: str, random: np.random.Generator) -> Iterator[FileFault]:
    """One fault of a random file below a folder while the block runs; then everything is as it was."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    victim = files[random.integers(len(files))]
    name = victim.relative_to(folder).as_posix()
    data, mode = victim.read_bytes(), victim.stat().st_mode & 0o777
    other = victim.with_name(victim.name + "".join(random.choice(list("abc.-"), 3)))
    try:
        detail = _harm(victim, other, data, kind, random)
        yield FileFault(kind, name, detail)
    finally:
        other.unlink(missing_ok=True)
        victim.unlink(missing_ok=True)
        victim.write_bytes(data)
        victim.chmod(mode)


def _harm(victim: Path, other: Path, data: bytes, kind: str, random: np.random.Generator) -> str:
    if kind in ("flip", "cut"):
        at = int(random.integers(len(data)))
        bit = int(random.integers(8))
        flipped = data[:at] + bytes([data[at] ^ 1 << bit]) + data[at + 1 :]
        victim.chmod(0o644)
        victim.write_bytes(flipped if kind == "flip" else data[:at])
        return f"bit {bit} of byte {at}" if kind == "flip" else f"to {at} bytes"
    if kind == "delete":
        victim.unlink()
    elif kind == "add":
        other.write_bytes(data if random.integers(2) else b"")
    else:
        victim.rename(other)
    return other.name
