"""No test may leave a thread, a child process or an open file behind."""

from __future__ import annotations

import gc
import os
import signal
import site
import sys
import sysconfig
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

import psutil
import pytest
from hypothesis import settings

from restore.errors import LibraryMissing
from restore.runtime.native import missing_libraries
from station import errors
from station.commands import terminal

settings.register_profile("no clock", deadline=None)  # how long a test takes is the machine's business
settings.load_profile("no clock")

# A run in the background of a script ignores Ctrl-C, and so would the processes that tests start and interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

MISSING = " ".join(library.package for library in missing_libraries())


@contextmanager
def _skipped_without_libraries() -> Iterator[None]:
    """Skip what needs a library that this system lacks, and name the packages that hold it."""
    try:
        yield
    except LibraryMissing as error:
        if MISSING:
            pytest.skip(f"needs the system packages {MISSING}: {error}")
        raise


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup() -> Iterator[None]:
    with _skipped_without_libraries():
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Iterator[None]:
    with _skipped_without_libraries():
        return (yield)


@pytest.fixture(autouse=True)
def _commands_are_skipped_without_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same for tests of the command, which would see an exit code."""

    def explain(error: BaseException) -> errors.Fault:
        with _skipped_without_libraries():
            if isinstance(error, LibraryMissing):
                raise error
        return errors.explain(error)

    if MISSING:
        monkeypatch.setattr(terminal, "explain", explain)


GRACE_SECONDS = 15.0  # a thread that was told to end may need a moment, on a busy machine several seconds
# Opened once for the life of the process, on first use: devices, the kernel's own tables, parts of installed libraries
# (fonts, kernel caches). They are no leak of the test that happens to come first.
LIBRARIES = tuple({sys.prefix, sys.base_prefix, sysconfig.get_paths()["stdlib"], *site.getsitepackages()})
CHILDREN_LISTED = Path(f"/proc/self/task/{os.getpid()}/children").exists()
LASTING = ("/dev/", "/proc/", "/sys/", "/usr/lib", "/usr/share", "/lib", *LIBRARIES)
OF_TESTS = os.environ.get("PYTEST_DEBUG_TEMPROOT", tempfile.gettempdir()) + "/pytest-of-"  # may be in /dev/shm


class Resources(NamedTuple):
    """What a process holds: threads of Python, child processes, open files as (descriptor, what it is)."""

    threads: frozenset[str]
    children: frozenset[str]
    files: frozenset[str]

    @classmethod
    def now(cls) -> Resources:
        threads = frozenset(f"thread {thread.name} ({thread.ident})" for thread in threading.enumerate())
        children = frozenset(f"process {child}" for child in _child_processes())
        return cls(threads, children, frozenset(_open_files()))

    def gained_since(self, before: Resources) -> list[str]:
        return sorted(gained for mine, theirs in zip(self, before, strict=True) for gained in mine - theirs)


def _child_processes() -> Iterator[int]:
    """Numbers of the processes below this one. Linux lists them; psutil would look at all processes of the system."""
    if not CHILDREN_LISTED:
        yield from (child.pid for child in psutil.Process().children(recursive=True))
        return
    waiting = [os.getpid()]
    while waiting:
        with suppress(OSError):  # it has ended
            for task in Path(f"/proc/{waiting.pop()}/task").iterdir():
                children = [int(number) for number in (task / "children").read_text().split()]
                yield from children
                waiting += children


def _open_files() -> Iterator[str]:
    for descriptor in Path("/proc/self/fd").iterdir():
        try:
            target = str(descriptor.readlink())
        except OSError:  # the listing's own
            continue
        if target.startswith(OF_TESTS) or not target.startswith(LASTING):
            yield f"file {descriptor.name} → {target}"


@contextmanager
def no_leaks(grace: float = GRACE_SECONDS) -> Iterator[None]:
    """Fail if the block leaves a thread, a child process or an open file behind."""
    before = Resources.now()
    yield
    deadline = time.monotonic() + grace
    while leaked := Resources.now().gained_since(before):
        gc.collect()  # what only waits for the collector is no leak
        if time.monotonic() > deadline:
            pytest.fail("left behind: " + ", ".join(leaked))
        time.sleep(0.01)


@pytest.fixture(autouse=True)
def _no_leaks() -> Iterator[None]:
    with no_leaks():
        yield


@pytest.fixture
def leak_check() -> Callable[[], AbstractContextManager[None]]:
    """The check itself, for the tests that show it can fail."""
    return partial(no_leaks, grace=0.0)


@pytest.fixture(scope="session")
def repository() -> Path:
    return Path(__file__).parent.parent
