"""State of the web interface: scanner, open session, control, jobs, kept pictures."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import drivers
from drivers import ScannerError
from drivers.scanner import Shot
from station.capture_loop.loop import Message
from station.capture_loop.triggering import laser_note
from station.capture_loop.turning import Place, place_of, stay
from station.config import StationConfig
from station.console.faults import REPORTED, ConsoleFault, problem_of
from station.console.shown_pages.layers import event_of
from station.console.shown_pages.layouts import Layouts
from station.console.shown_pages.models import Ruler, ruler_of
from station.console.shown_pages.tiles import Pyramids
from station.console.shown_pages.words import Words
from station.console.state import sessions, settings, tasks
from station.console.state.actions import DO, ON_A_PAGE, SHOTS
from station.console.state.broadcast import Broadcast
from station.console.state.control import Control
from station.console.state.event_stream import EventStream
from station.console.state.jobs import COMMAND, Job, Jobs
from station.console.state.open_session import Listener, OpenSession, Restorations, WritableSession
from station.console.state.preview import Preview, look_at
from station.console.state.scanner import Open, ScannerOwner
from station.console.state.shown import session_state, stamp, state_of
from station.errors import explain
from station.run.shots import range_image_of
from station.run.small_page import get_ready
from station.session.derivation.service import restore_keeping
from station.session.log.current import preset_of
from station.session.log.reading import VERIFY, SessionDamaged
from station.session.log.store import Session, read_session, utc
from station.session.operations.settings import change_settings
from station.session.terms.presets import Preset
from station.session.terms.texts import check_text
from station.verdict.thresholds import Thresholds
from station.workers.background import background

TRIGGER_S = 0.5  # between two looks for a shot of a scanner that is triggered by hand
WATCH_S = 2.0  # between two looks at a session that another process writes to
SHOT_S = 20.0  # for a shot that is under way when the server ends: a FINE one takes four, with focus six
Enter = Callable[[Session], None]
READY: Restorations = partial(background, restore_keeping, get_ready)


class AppState:
    """The console without HTTP.

    root    the folder with the sessions.
    config  of the station; None: pages are looked at, none is shot.
    station name of that configuration, which sessions that are made keep.
    enter   notes a session in the index of all sessions.
    restorations  gives the function that restores in the background.
    """

    def __init__(
        self,
        root: Path,
        config: StationConfig | None,
        *,
        station: str = "",
        enter: Enter = lambda _session: None,
        now: Callable[[], datetime] = utc,
        clock: Callable[[], float] = time.monotonic,
        open_scanner: Open = drivers.open_scanner,
        restorations: Restorations = READY,
        job_command: tuple[str, ...] = COMMAND,
    ) -> None:
        self.root, self.station, self.now = root, station, now
        self.event_stream = EventStream()
        self.broadcast = Broadcast(self.event_stream, self.state)
        self.control = Control(clock, now)
        self.scanner = ScannerOwner(config, self.broadcast.changed, now, open_scanner)
        self.jobs = Jobs(self.broadcast.job, now, command=job_command)
        self.pyramids, self.words, self.layouts = Pyramids(), Words(), Layouts()
        self.open_session: OpenSession | None = None
        self.failed: dict[str, Any] | None = None
        self.preview: Preview | None = None
        self._enter, self._restorations = enter, restorations
        self._unrecorded = settings.changes_of(None)
        self._ruler: tuple[tuple[str, int, str], Ruler] | None = None
        self._lock = threading.Lock()
        self._tasks: list[asyncio.Task[None]] = []

    async def start(self) -> None:
        """Open the scanner, and send events from now on."""
        self.broadcast.start()
        self.jobs.start()
        self._tasks = [asyncio.create_task(self._watch()), asyncio.create_task(self._trigger())]
        if self.scanner.config is not None:
            self.scanner.connect()

    async def stop(self) -> None:
        """End the jobs; send nothing more."""
        await self.jobs.stop()
        self.broadcast.stop()
        for task in self._tasks:
            task.cancel()

    def end(self) -> None:
        """Store a running capture, close the session, switch the laser off.

        Raises ScannerError.
        """
        opened, self.open_session = self.open_session, None
        if isinstance(opened, WritableSession):
            ending = threading.Thread(target=opened.close, daemon=True)
            ending.start()
            if not opened.join(SHOT_S):
                self.scanner.cancel()
            ending.join()
        self.scanner.close()

    def state(self) -> dict[str, Any]:
        """The state of the station as JSON values. Raises OSError."""
        self._drop_unreadable()
        return state_of(self.root, self.open_session, self.scanner, self.control, self.jobs, self.failed, self.now())

    # The open session.

    def open(self, name: str, *, read_only: bool = False) -> None:
        """Open a session, after closing the one that is open.

        It is open with all that is shown of it, or not at all. Raises ConsoleFault, StationError, OSError.
        """
        with self._lock:
            folder = sessions.find(self.root, name)
            self._close()
            self.failed = None
            self.open_session = self._watched(folder) if read_only else self._worked_on(folder)
            self._take_settings()
        self.broadcast.all_changed()
        if self.scanner.config is not None and (note := laser_note(self.scanner.config.scanner)):
            self.broadcast.line(Message(note, "laser_unknown"))

    def close(self) -> None:
        """Close the open session, if any.

        Raises ConsoleFault while a capture is under way.
        """
        with self._lock:
            self._close()
        self.broadcast.all_changed()

    def create(self, name: str, **fields: Any) -> dict[str, Any]:
        """Make a session, and return its entry in the list.

        Raises ConsoleFault, UsageError, OSError.
        """
        with self._lock:
            folder = sessions.create(self.root, name, station=self.station, **fields)
        session = read_session(folder)
        self._enter(session)
        return sessions.entry_of(session, None)

    def opened(self) -> OpenSession:
        """The open session. Raises ConsoleFault."""
        opened = self.open_session
        if opened is None:
            raise ConsoleFault("no_session_open", "no session is open", "open one, or make one")
        return opened

    def writable(self) -> WritableSession:
        """Return the open session, to be written to.

        Raises ConsoleFault when another process has it.
        """
        opened = self.opened()
        if not isinstance(opened, WritableSession):
            held_by = opened.held_by
            raise ConsoleFault("in_use", f"process {held_by} has this session", "end it there", held_by=held_by)
        return opened

    def folder_of(self, name: str | None) -> Path:
        """The folder of a session, of the open one where none is named. Raises ConsoleFault."""
        return self.opened().folder if name is None else sessions.find(self.root, name)

    @property
    def held(self) -> Path | None:
        """The folder of the session that this process writes to."""
        return self.open_session.folder if isinstance(self.open_session, WritableSession) else None

    def _worked_on(self, folder: Path) -> WritableSession:
        shoot = None if self.scanner.config is None else self.scanner.capture
        listener = Listener(self._line, self._session_changed, self._loop_ended)
        opened = WritableSession(
            folder, shoot, listener, restorations=self._restorations, turn=self.scanner.turn if shoot else stay
        )
        opened.start()
        with _all_or_nothing(opened):
            self._enter(opened.session)
        return opened

    def _watched(self, folder: Path) -> OpenSession:
        opened = OpenSession(folder, held_by=sessions.holder_of(folder) or "")
        with _all_or_nothing(opened):
            return opened

    def _drop_unreadable(self) -> None:
        """Close a session of another process that cannot be read any more.

        The reason is reported.
        """
        opened = self.open_session
        if opened is None or not opened.is_read_only:
            return
        try:
            session_state(opened)
        except Exception as error:
            self.failed, self.open_session = problem_of(error), None

    def _close(self) -> None:
        if self.open_session is not None:
            if not self.open_session.is_read_only and self.scanner.as_json()["busy"] == "capture":
                raise ConsoleFault("session_open", "a page is being captured", "wait until it is stored")
            opened, self.open_session = self.open_session, None
            opened.close()

    # What the operator does.

    def press(self, action: str, page: int | None = None, text: str | None = None) -> int | None:
        """Queue an action of the operator; return its page.

        It acts on the current page where none is named. Returns at once. Raises ConsoleFault when it cannot be done,
        UsageError for control characters in the text.
        """
        if action == "preview":
            self.look()
            return None
        opened = self.writable()
        if text is not None:
            text = check_text(action, text)
        page = page or opened.page
        if action in ON_A_PAGE:
            if page is None:
                raise ConsoleFault("no_page", "no page has been captured yet", "capture the first one")
            opened.row(page)
        if action in SHOTS:
            self.scanner.reserve("capture")

        def task() -> None:
            assert opened.loop is not None
            try:
                DO[action](opened.loop, page or 0, text or "")
            finally:
                if action in SHOTS:
                    self.scanner.release()
                    self._send_rows()  # its restoration has begun

        try:
            opened.do(task)
        except ConsoleFault:  # it was closed at the same moment
            if action in SHOTS:
                self.scanner.release()
            raise
        return page

    def look(self) -> None:
        """Take a preview, and send it when it is there. Raises ConsoleFault."""
        if self.scanner.is_self_triggered:
            raise ConsoleFault("no_preview", "this scanner is triggered by hand: it has no preview")
        self.scanner.reserve("preview")
        self.scanner.preview(self._present()).add_done_callback(self._previewed)

    def begin(self, task: tasks.Task) -> Job:
        """Have a task done by a job. Raises ConsoleFault."""
        return self.jobs.begin(*task)

    def all_settings(self) -> dict[str, Any]:
        """Return the current settings next to those of the preset."""
        session = None if self.open_session is None else self.open_session.session
        base = None if session is None else Preset.model_validate(session.volume.preset_values)
        return {
            "groups": settings.groups(self.scanner.configured, base, self._changes(), without=self.scanner.unmeasured)
        }

    def change(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Change settings by their keys, and return all.

        Raises ConsoleFault for a value that is not possible.
        """
        if self.scanner.as_json()["busy"] is not None:
            raise ConsoleFault("busy", "the scanner is capturing", "change settings when it has ended")
        opened = None if self.open_session is None else self.writable()
        base = None if opened is None else Preset.model_validate(opened.session.volume.preset_values)
        changes = settings.changed(self._changes(), values, self.scanner.configured, base)
        if opened is None:
            self._unrecorded = changes
        else:
            opened.change(partial(change_settings, changed=settings.as_decision(changes)))
        self._take_settings()
        self.broadcast.changed()
        return self.all_settings()

    def ruler(self, number: int, leaf: str = "") -> Ruler:
        """Return the ruler of a restoration; the last one is kept.

        leaf: before the names of its layers. Raises ConsoleFault.
        """
        session = self.opened().session
        key = (session.identifier, number, leaf)
        kept = self._ruler
        if kept is None or kept[0] != key:
            kept = self._ruler = (key, ruler_of(session, event_of(session, number), leaf))
        return kept[1]

    def _changes(self) -> settings.Changes:
        return self._unrecorded if self.open_session is None else settings.changes_of(self.open_session.session)

    def _take_settings(self) -> None:
        """Use the settings of a capture as they are now.

        A session was opened, a change made or taken back.
        """
        with suppress(ScannerError, TypeError):  # of another version; those before are used
            self.scanner.settings = settings.capture_settings(self.scanner.configured, self._changes())

    def _present(self) -> Place:
        """Return the place of the current page; the first opening before there is any."""
        opened = self.open_session
        page = None if opened is None else opened.page
        return Place(0, 0) if opened is None or page is None else place_of(opened.session.history, page)

    def _previewed(self, shot: Future[Shot]) -> None:
        try:
            seen = look_at(range_image_of(shot.result(), "a preview"), self._thresholds())
            number = 1 if self.preview is None else int(self.preview.facts["n"]) + 1
            links = {"image": f"/api/preview/{number}.jpg", "overlay": f"/api/preview/{number}/overlay.png"}
            self.preview = replace(seen, facts={"n": number, "time": stamp(self.now()), **seen.facts, **links})
            self.event_stream.publish("preview", self.preview.facts)
        except Exception as error:  # of any kind: a preview ends nothing
            problem = problem_of(error)
            self.broadcast.line(Message(f"no preview: {problem['text']}", "not_shot"), problem)
        finally:
            self.scanner.release()

    def _thresholds(self) -> Thresholds:
        return Thresholds() if self.open_session is None else preset_of(self.open_session.session).thresholds

    # What the capture loop reports, from its own thread.

    def _line(self, message: Message) -> None:
        self.broadcast.line(message)
        self._send_rows()

    def _session_changed(self) -> None:
        if self.open_session is not None:
            self._enter(self.open_session.session)
            self._take_settings()
        self._send_rows()

    def _send_rows(self) -> None:
        opened = self.open_session
        if opened is not None:
            self.broadcast.rows(opened.rows())

    def _loop_ended(self, error: BaseException | None) -> None:
        if error is not None:
            self.failed = problem_of(error)
            self.open_session = None
            self.scanner.release()
        self.broadcast.all_changed()

    async def _trigger(self) -> None:
        """Capture what a scanner that is triggered by hand has, while a session is open."""
        while True:
            await asyncio.sleep(TRIGGER_S)
            if self.held is not None and await asyncio.to_thread(lambda: self.scanner.has_shot):
                with suppress(ConsoleFault):  # the operator was quicker
                    self.press("capture")

    async def _watch(self) -> None:
        """Watch a session that another process writes to.

        While one is open and a browser shows it.
        """
        while True:
            await asyncio.sleep(WATCH_S)
            opened = self.open_session
            if opened is not None and opened.is_read_only and self.event_stream.count:
                with suppress(Exception):
                    await asyncio.to_thread(self._send_rows)


@contextmanager
def _all_or_nothing(opened: OpenSession) -> Iterator[None]:
    """Close a session whose block fails, or of which not all can be shown.

    Raises SessionDamaged for any other error.
    """
    try:
        yield
        session_state(opened)
        settings.changes_of(opened.session)
    except BaseException as error:
        opened.close()
        if isinstance(error, REPORTED) or not isinstance(error, Exception):
            raise
        raise SessionDamaged(f"{opened.folder} cannot be shown: {explain(error).message}", VERIFY) from error
