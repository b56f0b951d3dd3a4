"""The one open session.

Its capture loop works in a thread, or another process has it and this one reads it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from drivers.scanner import Shot
from restore import BadInput
from station.capture_loop.loop import CaptureLoop, Show, Task
from station.capture_loop.turning import Place, stay
from station.console.faults import ConsoleFault
from station.console.shown_pages.rows import Row, rows_of
from station.session import Event, Session, SessionBroken, Writer, open_session, read_session
from station.session.derivation.service import Submit, next_step, restore_keeping
from station.session.log.bag import LOG, TAG_MANIFEST
from station.session.log.store import identity_of
from station.session.operations.arrangement import NoSuchLeaf
from station.session.operations.tags import Stale
from station.workers.background import background

DECISION_S = 150.0  # for a decision to be recorded: after the shot that is under way, at the latest
MEASURED = 10  # pages whose size predicts how many more the disk takes
OUTPUTS = ("model",)  # files of a restoration that the web interface shows, in addition to the preset's

T = TypeVar("T")
Operation = Callable[[Writer], Event | None]
Current = Callable[[Session], Mapping[str, Any]]
Restorations = Callable[[], AbstractContextManager[Submit]]
IN_BACKGROUND: Restorations = partial(background, restore_keeping)


@dataclass(frozen=True)
class Listener:
    """What an open session calls, from its own thread.

    line     with each line for the operator.
    changed  when rows or the state have changed.
    ended    with the error that ended the loop, None when it was closed.
    """

    line: Show
    changed: Callable[[], None]
    ended: Callable[[BaseException | None], None]


class _Leave(Exception):
    """Raised in the loop's thread to end it.

    What is being restored is continued at the next opening.
    """


class OpenSession:
    """An open session.

    name  of its folder. held_by: the process that has it, when it is only read.
    """

    def __init__(self, folder: Path, *, held_by: str = "") -> None:
        self.folder, self.name, self.held_by = folder, folder.name, held_by
        self._rows: tuple[tuple[int, tuple[int, ...]], list[Row]] | None = None
        self._read: tuple[tuple[object, int], Session] | None = None

    @property
    def is_read_only(self) -> bool:
        """Whether another process writes to the session."""
        return True

    @property
    def session(self) -> Session:
        """The session as it stands."""
        now = identity_of(self.folder), _size(self.folder / LOG)
        if self._read is None or self._read[0] != now:
            self._read, self._rows = (now, read_session(self.folder)), None
        return self._read[1]

    @property
    def page(self) -> int | None:
        """The page that keys act on."""
        return None

    @property
    def restoring(self) -> list[int]:
        """Pages that are being restored."""
        return []

    @property
    def recovery(self) -> dict[str, Any] | None:
        """What was taken up when the session was opened."""
        return None

    def rows(self) -> list[Row]:
        """The rows of the strip; computed when the session or the restorations have changed."""
        session, restoring = self.session, tuple(self.restoring)
        key = (len(session.history.events), restoring)
        if self._rows is None or self._rows[0] != key:
            self._rows = (key, rows_of(session, restoring))
        return self._rows[1]

    def row(self, number: int) -> Row:
        """The row of a page. Raises ConsoleFault."""
        for row in self.rows():
            if row["page"] == number:
                return row
        raise ConsoleFault("no_page", f"the session has no page {number}")

    def page_sizes(self) -> list[int]:
        """Return the bytes of each of the latest restored pages: its scan and its derivatives."""
        session, sizes = self.session, []
        for row in self.rows()[-MEASURED:]:
            if row["restore"] is not None:
                events = [session.history.event(row[name]) for name in ("capture", "restore")]
                sizes.append(sum(_size(session.path(event, name)) for event in events for name in event.files))
        return sizes

    def close(self) -> None:
        """Let the session go."""


class WritableSession(OpenSession):
    """A session that this process writes to. `start` returns when it is open."""

    def __init__(
        self,
        folder: Path,
        shoot: Callable[[], Shot] | None,
        listener: Listener,
        *,
        restorations: Restorations = IN_BACKGROUND,
        outputs: tuple[str, ...] = OUTPUTS,
        turn: Callable[[Place], None] = stay,
    ) -> None:
        super().__init__(folder)
        self._turn = turn
        self._shoot, self._listener, self._restorations, self._outputs = shoot, listener, restorations, outputs
        self._opened: Future[None] = Future()
        self._thread = threading.Thread(target=self._work, name=f"capture loop {self.name}", daemon=True)
        self._recovery: dict[str, Any] | None = None
        self._resumed: list[int] = []
        self.loop: CaptureLoop | None = None
        self._taking = threading.Lock()
        self._is_leaving = False

    def start(self) -> None:
        """Open the session. Raises FolderInUse, BadInput, SessionDamaged, OSError."""
        self._thread.start()
        try:
            self._opened.result()
        except BaseException:
            self._thread.join()
            raise

    @property
    def is_read_only(self) -> bool:
        return False

    @property
    def session(self) -> Session:
        return self._running.writer.session

    @property
    def page(self) -> int | None:
        return self._running.page

    @property
    def restoring(self) -> list[int]:
        return self._running.restoring

    @property
    def recovery(self) -> dict[str, Any] | None:
        if self._recovery is None:
            return None
        waiting = set(self.restoring)
        return {**self._recovery, "resumed": self._resumed, "left": len(waiting & set(self._resumed))}

    def do(self, task: Task) -> None:
        """Have something done by the loop, between two keys.

        Raises ConsoleFault when it is being closed.
        """
        with self._taking:
            if self._is_leaving:
                raise ConsoleFault("no_session_open", f"{self.name} is being closed", "open it again")
            self._running.inbox.put(task)

    def ask(self, work: Callable[[CaptureLoop], T]) -> T:
        """Have something done by the loop, and return its result when it is stored.

        A fault costs the request and not the loop, except one of the disk. Raises OSError, what the work raises.
        """
        done: Future[T] = Future()

        def task() -> None:
            try:
                done.set_result(work(self._running))
            except BaseException as error:
                done.set_exception(error)
                if isinstance(error, OSError | SessionBroken) or not isinstance(error, Exception):
                    raise

        self.do(task)
        return done.result(DECISION_S)

    def change(self, operation: Operation, current: Current = lambda _session: {}) -> Event | None:
        """Have an operation change the session, and return its event when it is stored.

        current: gives what stands, with its tag; for a change with a tag of its own. Raises ConsoleFault with it where
        that is another one by now, and for what cannot be, UsageError, OSError when the disk refuses.
        """
        try:
            return self.ask(lambda loop: loop.change(operation))
        except Stale as error:
            raise ConsoleFault.changed(str(error), current(self.session)) from error
        except NoSuchLeaf as error:
            raise ConsoleFault("no_page", str(error), "load the leaves again") from error
        except BadInput as error:
            raise ConsoleFault("invalid", str(error), error.hint) from error

    def close(self) -> None:
        """Let the loop end after its current work, and wait.

        A capture that is under way is stored.
        """

        def leave() -> None:
            raise _Leave

        with self._taking:  # what was taken before is done before
            self._is_leaving = True
            self._running.inbox.put(leave)
        self._thread.join()

    def join(self, timeout: float) -> bool:
        """Wait for the end of the loop. Returns whether it has ended."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

    @property
    def _running(self) -> CaptureLoop:
        assert self.loop is not None  # `start` has returned
        return self.loop

    def _work(self) -> None:
        try:
            with ExitStack() as stack:
                try:
                    self._open(stack)
                except BaseException as error:
                    self._opened.set_exception(error)
                    return
                self._opened.set_result(None)
                try:
                    self._running.run()
                finally:
                    with self._taking:
                        self._is_leaving = True
        except _Leave:
            self._listener.ended(None)
        except BaseException as error:
            self._listener.ended(error)

    def _open(self, stack: ExitStack) -> None:
        before = _tag_manifest(self.folder)
        writer = stack.enter_context(open_session(self.folder))
        completed = before != _tag_manifest(self.folder)
        submit = stack.enter_context(self._restorations())
        self._resumed = [page.number for page in writer.history.pages() if next_step(writer.session, page)]
        if completed or self._resumed:
            self._recovery = {"completed": completed, "problem": None}
        self.loop = CaptureLoop(
            writer,
            self._shoot,
            submit,
            self._listener.line,
            changed=self._listener.changed,
            outputs=self._outputs,
            turn=self._turn,
        )


def _size(path: Path) -> int:
    try:
        return path.lstat().st_size
    except OSError:
        return 0


def _tag_manifest(folder: Path) -> bytes:
    try:
        return (folder / TAG_MANIFEST).read_bytes()
    except OSError:
        return b""
