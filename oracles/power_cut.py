"""What a disk holds after a power cut: a model that is told of every flush and knows nothing else to be durable.

A file's content is durable as it was at its last fsync, a folder's names as they were at the folder's. What changed
since may be there, in part, or not at all, each file and each name by itself.
"""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

# Events of sys.audit that come before a call that changes names or begins to write.
CHANGES = frozenset({"open", "os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.link", "os.truncate"})


@dataclass
class Disk:
    """The durable state of a folder and all below it, by inode."""

    root: Path
    contents: dict[int, bytes] = field(default_factory=dict)
    names: dict[int, dict[str, int]] = field(default_factory=dict)

    @classmethod
    def of(cls, root: Path) -> Disk:
        """A disk on which all that is there is durable."""
        disk = cls(root)
        for base, folders, files in os.walk(root):
            disk.flush_folder(Path(base))
            for name in files:
                disk.flush_file(Path(base) / name)
            del folders
        return disk

    def flush_file(self, path: Path) -> None:
        """Take the content of a file for durable."""
        self.contents[path.stat().st_ino] = path.read_bytes()

    def flush_folder(self, path: Path) -> None:
        """Take the names in a folder for durable."""
        self.names[path.stat().st_ino] = {entry.name: entry.inode() for entry in os.scandir(path)}

    def write(self, target: Path, random: np.random.Generator | None) -> None:
        """Write the folder as a power cut may leave it. random: chooses what survived; None: only what was flushed."""
        self._folder(self.root.stat().st_ino, self.root, target, random)

    def is_durable(self, path: Path, *, without: frozenset[str] = frozenset()) -> bool:
        """Whether everything at and below a path is on the disk as it stands now. without: names at the top."""
        status = path.lstat()
        if stat.S_ISREG(status.st_mode):
            return self.contents.get(status.st_ino) == path.read_bytes()
        now = {entry.name: entry.inode() for entry in os.scandir(path) if entry.name not in without}
        kept = {name: node for name, node in self.names.get(status.st_ino, {}).items() if name not in without}
        return now == kept and all(self.is_durable(path / name) for name in now)

    def _folder(self, inode: int, live: Path | None, target: Path, random: np.random.Generator | None) -> None:
        target.mkdir()
        durable = self.names.get(inode, {})
        now = {entry.name: entry.inode() for entry in os.scandir(live)} if live else {}
        for name in sorted({*durable, *now}):
            before, after = durable.get(name), now.get(name)
            node = before if random is None or (before != after and random.integers(2)) else after
            if node is None:
                continue
            path = live / name if live and node == after else None
            if node in self.names or (path is not None and path.is_dir()):
                self._folder(node, path, target / name, random)
            else:
                (target / name).write_bytes(self._content(node, path, random))

    def _content(self, inode: int, live: Path | None, random: np.random.Generator | None) -> bytes:
        """The content of a file: what was flushed, what stands there now, or part of it, the rest missing or zero."""
        durable = self.contents.get(inode, b"")
        if random is None or live is None:
            return durable
        now = live.read_bytes()
        if now == durable:
            return now
        end = int(random.integers(min(len(durable), len(now)), len(now) + 1))
        partial = now[:end] + (b"\0" * (len(now) - end) if random.integers(2) else b"")
        return (durable, now, partial)[random.integers(3)]


@contextmanager
def watched(root: Path, look: Callable[[Disk, str, tuple[Any, ...]], None]) -> Iterator[Disk]:
    """Follow a folder while the block runs: `look` is called before every change below it and after every flush."""
    disk, fsync, state = Disk.of(root), os.fsync, {"on": True}
    inside = os.fspath(root) + os.sep

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        if not state["on"] or event not in CHANGES:
            return
        if event == "open" and not _writes(arguments):
            return
        if any(isinstance(one, str | os.PathLike) and os.fspath(one).startswith(inside) for one in arguments[:2]):
            _quietly(state, lambda: look(disk, event, arguments))

    def flush(descriptor: int) -> None:
        fsync(descriptor)
        path = Path(f"/proc/self/fd/{descriptor}").readlink()

        def take() -> None:
            disk.flush_folder(path) if path.is_dir() else disk.flush_file(path)
            look(disk, "fsync", (path,))

        if path == root or os.fspath(path).startswith(inside):
            _quietly(state, take)

    sys.addaudithook(audit)  # which no program can take back: it is switched off instead
    os.fsync = flush  # type: ignore[assignment]
    try:
        yield disk
    finally:
        state["on"] = False
        os.fsync = fsync


def _writes(arguments: tuple[Any, ...]) -> bool:
    flags = arguments[2] if len(arguments) > 2 else 0
    return isinstance(flags, int) and bool(flags & (os.O_WRONLY | os.O_RDWR))


def _quietly(state: dict[str, bool], work: Callable[[], None]) -> None:
    """Run what itself opens files without following it."""
    state["on"] = False
    try:
        work()
    finally:
        state["on"] = True
