"""One owner of a device: the second is refused and learns who holds it; the end of a process frees it."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from drivers.scanner import TransportError
from drivers.scsi.ownership import SHOWN_COMMAND, holders, in_use, lock_node, open_locked, process_name
from drivers.scsi.sg import SgDevice

HOLD = "import sys; from pathlib import Path; from drivers.scsi.{module} import {open}; "
HOLD += "held = {open}(Path(sys.argv[1])); print('held', flush=True); sys.stdin.read()"
OPEN_ONLY = "import sys; held = open(sys.argv[1]); print('held', flush=True); sys.stdin.read()"
LOCK, SG = HOLD.format(module="ownership", open="open_locked"), HOLD.format(module="sg", open="SgDevice")


@pytest.fixture
def node(tmp_path: Path) -> Path:
    path = tmp_path / "sg0"
    path.touch()
    return path


@contextmanager
def program(code: str, node: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Another process that holds the node until the end of the block."""
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", code, str(node), "scan"], stdin=pipe, stdout=pipe) as process:
        assert process.stdout.readline() == b"held\n"
        yield process
        process.stdin.close()


@pytest.mark.parametrize("code", [LOCK, SG])
def test_a_second_program_is_refused_by_the_name_of_the_holder(node: Path, code: str) -> None:
    with program(code, node) as other:
        for attempt in (open_locked, SgDevice):
            with pytest.raises(TransportError, match=f"process {other.pid} .*python") as caught:
                attempt(node)
            assert caught.value.hint
    SgDevice(node).close()  # it has ended


def test_a_killed_program_holds_nothing(node: Path) -> None:
    with program(SG, node) as other:
        other.kill()
        other.wait()
        SgDevice(node).close()


def test_a_program_without_a_lock_is_named_by_its_open_file(node: Path) -> None:
    with program(OPEN_ONLY, node) as other:
        assert holders(node) == [other.pid]
        assert f"process {other.pid}" in str(in_use(node))


def test_the_same_program_twice(node: Path) -> None:
    first = SgDevice(node)
    with pytest.raises(TransportError, match="this program itself"):
        SgDevice(node)
    first.close()
    SgDevice(node).close()


def test_a_refused_lock_leaves_no_file_open(node: Path) -> None:
    held = open_locked(node)
    before = len(list(Path("/proc/self/fd").iterdir()))
    for attempt in (open_locked, SgDevice):
        with pytest.raises(TransportError):
            attempt(node)
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    os.close(held)


def test_a_node_that_cannot_be_opened_has_no_lock(tmp_path: Path) -> None:
    assert open_locked(tmp_path / "gone") is None
    assert str(in_use(tmp_path / "gone")).endswith("another program")


def test_the_kernels_list_is_read_by_device_and_inode(node: Path, tmp_path: Path) -> None:
    file = node.stat()
    where = f"{os.major(file.st_dev):02x}:{os.minor(file.st_dev):02x}"
    lines = (
        f"1: FLOCK  ADVISORY  WRITE 4711 {where}:{file.st_ino} 0 EOF",
        f"1: -> FLOCK  ADVISORY  WRITE 4712 {where}:{file.st_ino} 0 EOF",
        f"2: FLOCK  ADVISORY  WRITE 4713 {where}:{file.st_ino + 1} 0 EOF",
        f"3: OFDLCK ADVISORY  WRITE -1 {where}:{file.st_ino} 0 EOF",
        "4: FLOCK",
    )
    (tmp_path / "locks").write_text("\n".join(lines))
    assert holders(node, tmp_path) == [4711]


def test_a_process_is_named_by_a_short_command_line(tmp_path: Path) -> None:
    (tmp_path / "4711").mkdir()
    (tmp_path / "4711/cmdline").write_bytes(b"planish\0scan\0--config\0" + b"x" * 200 + b"\0")
    name = process_name(4711, tmp_path)
    assert name.startswith("process 4711 (planish scan --config xxx")
    assert len(name) < SHOWN_COMMAND + 20
    assert process_name(4712, tmp_path) == "process 4712"


def test_a_lock_is_the_kernels_own(node: Path) -> None:
    descriptor = os.open(node, os.O_RDWR)
    lock_node(descriptor, node)
    with node.open("rb") as other, pytest.raises(BlockingIOError):
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
    os.close(descriptor)
