"""All that the console works with: the scanner, the open session, who acts, jobs, and what is kept in memory."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import drivers
from drivers import ScannerError
from restore import RangeScan
from station.config import StationConfig
from station.console.faults import ConsoleFault, problem_of
from station.console.shown_pages.layers import event_of
from station.console.shown_pages.models import Ruler, ruler_of
from station.console.shown_pages.tiles import Pyramids
from station.console.shown_pages.words import Words
from station.console.state import sessions, settings, tasks
from station.console.state.actions import DO, ON_A_PAGE, SHOTS
from station.console.state.broadcast import Broadcast
from station.console.state.control import Control
from station.console.state.event_stream import Hub
from station.console.state.jobs import COMMAND, Job, Jobs
from station.console.state.open_session import Listener, Restorations, Sitting, Working
from station.console.state.preview import Preview, look_at
from station.console.state.scanner import Open, ScannerOwner
from station.console.state.shown import stamp, state_of
from station.run.small_page import get_ready
from station.session.overview import SETTINGS, preset_of
from station.session.presets import Preset
from station.session.stages import run_restore
from station.session.store import Session, read_session, utc
from station.verdict.thresholds import Thresholds
from station.workers.background import background

WATCH_S = 2.0  # between two looks at a session that another process writes to
SHOT_S = 20.0  # for a shot that is under way when the server ends: a FINE one takes four, with focus six
Enter = Callable[[Session], None]
READY: Restorations = partial(background, run_restore, get_ready)


class Desk:
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
        self.hub = Hub()
        self.told = Broadcast(self.hub, self.state)
        self.control = Control(clock, now)
        self.scanner = ScannerOwner(config, self.told.changed, now, open_scanner)
        self.jobs = Jobs(self.told.job, now, command=job_command)
        self.pyramids, self.words = Pyramids(), Words()
        self.sitting: Sitting | None = None
        self.failed: dict[str, Any] | None = None
        self.preview: Preview | None = None
        self._enter, self._restorations = enter, restorations
        self._unrecorded = settings.changes_of(None)
        self._ruler: tuple[tuple[str, int], Ruler] | None = None
        self._lock = threading.Lock()
        self._watching: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Open the scanner, and send events from now on."""
        self.told.start()
        self.jobs.start()
        self._watching = asyncio.create_task(self._watch())
        if self.scanner.config is not None:
            self.scanner.connect()

    async def stop(self) -> None:
        """End the jobs; send nothing more."""
        await self.jobs.stop()
        self.told.stop()
        if self._watching is not None:
            self._watching.cancel()

    def end(self) -> None:
        """Let a shot that is under way be stored, close the session, switch the laser off. Raises ScannerError."""
        sitting, self.sitting = self.sitting, None
        if isinstance(sitting, Working):
            ending = threading.Thread(target=sitting.close, daemon=True)
            ending.start()
            if not sitting.join(SHOT_S):
                self.scanner.cancel()
            ending.join()
        self.scanner.close()

    def state(self) -> dict[str, Any]:
        """The state of the station as JSON values. Raises OSError."""
        return state_of(self.root, self.sitting, self.scanner, self.control, self.jobs, self.failed, self.now())

    # The open session.

    def open(self, name: str, *, read_only: bool = False) -> None:
        """Open a session, after closing the one that is open. Raises ConsoleFault, StationError, OSError."""
        with self._lock:
            folder = sessions.find(self.root, name)
            self._close()
            self.failed = None
            self.sitting = self._watched(folder) if read_only else self._worked_on(folder)
            self._take_settings()
        self.told.all_changed()

    def close(self) -> None:
        """Close the open session, if there is one. Raises ConsoleFault while a shot is under way."""
        with self._lock:
            self._close()
        self.told.all_changed()

    def create(self, name: str, **fields: Any) -> dict[str, Any]:
        """Make a session, and return its entry in the list. Raises ConsoleFault, UsageError, OSError."""
        with self._lock:
            folder = sessions.create(self.root, name, station=self.station, **fields)
        session = read_session(folder)
        self._enter(session)
        return sessions.entry_of(session, None)

    def opened(self) -> Sitting:
        """The open session. Raises ConsoleFault."""
        sitting = self.sitting
        if sitting is None:
            raise ConsoleFault("no_session_open", "no session is open", "open one, or make one")
        return sitting

    def working(self) -> Working:
        """The open session, to be written to. Raises ConsoleFault when another process has it."""
        sitting = self.opened()
        if not isinstance(sitting, Working):
            held_by = sitting.held_by
            raise ConsoleFault("in_use", f"process {held_by} has this session", "end it there", held_by=held_by)
        return sitting

    def folder_of(self, name: str | None) -> Path:
        """The folder of a session, of the open one where none is named. Raises ConsoleFault."""
        return self.opened().folder if name is None else sessions.find(self.root, name)

    @property
    def held(self) -> Path | None:
        """The folder of the session that this process writes to."""
        return self.sitting.folder if isinstance(self.sitting, Working) else None

    def _worked_on(self, folder: Path) -> Working:
        shoot = None if self.scanner.config is None else self.scanner.capture
        listener = Listener(self._line, self._session_changed, self._loop_ended)
        sitting = Working(folder, shoot, listener, restorations=self._restorations)
        sitting.start()
        self._enter(sitting.session)
        return sitting

    def _watched(self, folder: Path) -> Sitting:
        sitting = Sitting(folder, held_by=sessions.holder_of(folder) or "")
        sitting.rows()
        return sitting

    def _close(self) -> None:
        if self.sitting is not None:
            if not self.sitting.is_read_only and self.scanner.as_json()["busy"] == "shoot":
                raise ConsoleFault("session_open", "a page is being shot", "wait until it is stored")
            sitting, self.sitting = self.sitting, None
            sitting.close()

    # What the operator does.

    def press(self, action: str, page: int | None = None, text: str | None = None) -> int | None:
        """Have an action of the operator done, on the current page where none is named; returns its page.

        Returns at once. Raises ConsoleFault when it cannot be done.
        """
        if action == "preview":
            self.look()
            return None
        sitting = self.working()
        page = page or sitting.page
        if action in ON_A_PAGE:
            if page is None:
                raise ConsoleFault("no_page", "there is no page yet", "shoot the first one")
            sitting.row(page)
        if action in SHOTS:
            self.scanner.reserve("shoot")

        def task() -> None:
            assert sitting.loop is not None
            try:
                DO[action](sitting.loop, page or 0, text or "")
            finally:
                if action in SHOTS:
                    self.scanner.release()
                    self._send_rows()  # its restoration has begun

        sitting.do(task)
        return page

    def look(self) -> None:
        """Take a preview, and send it when it is there. Raises ConsoleFault."""
        self.scanner.reserve("preview")
        self.scanner.preview().add_done_callback(self._previewed)

    def begin(self, task: tasks.Task) -> Job:
        """Have a task done by a job. Raises ConsoleFault."""
        return self.jobs.begin(*task)

    def all_settings(self) -> dict[str, Any]:
        """The settings as they stand beside those of the preset."""
        session = None if self.sitting is None else self.sitting.session
        base = None if session is None else Preset.model_validate(session.volume.settings)
        return {"groups": settings.groups(self.scanner.configured, base, self._changes())}

    def change(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Change settings by their keys, and return all. Raises ConsoleFault for a value that is not possible."""
        if self.scanner.as_json()["busy"] is not None:
            raise ConsoleFault("busy", "the scanner is shooting", "change settings when it has ended")
        sitting = None if self.sitting is None else self.working()
        base = None if sitting is None else Preset.model_validate(sitting.session.volume.settings)
        changes = settings.changed(self._changes(), values, self.scanner.configured, base)
        if sitting is None:
            self._unrecorded = changes
        else:
            sitting.decide(SETTINGS, settings.as_decision(changes))
        self._take_settings()
        self.told.changed()
        return self.all_settings()

    def ruler(self, number: int) -> Ruler:
        """The ruler of a restoration, the last one that was asked for is kept. Raises ConsoleFault."""
        session = self.opened().session
        key = (session.identifier, number)
        kept = self._ruler
        if kept is None or kept[0] != key:
            kept = self._ruler = (key, ruler_of(session, event_of(session, number)))
        return kept[1]

    def _changes(self) -> settings.Changes:
        return self._unrecorded if self.sitting is None else settings.changes_of(self.sitting.session)

    def _take_settings(self) -> None:
        """Use the settings of a capture as they are now: a session was opened, a change made or taken back."""
        with suppress(ScannerError, TypeError):  # of another version; those before are used
            self.scanner.settings = settings.capture_settings(self.scanner.configured, self._changes())

    def _previewed(self, shot: Future[RangeScan]) -> None:
        try:
            seen = look_at(shot.result(), self._thresholds())
            number = 1 if self.preview is None else int(self.preview.facts["n"]) + 1
            links = {"image": f"/api/preview/{number}.jpg", "overlay": f"/api/preview/{number}/overlay.png"}
            self.preview = replace(seen, facts={"n": number, "time": stamp(self.now()), **seen.facts, **links})
            self.hub.publish("preview", self.preview.facts)
        except Exception as error:  # of any kind: a preview ends nothing
            told = problem_of(error)
            self.told.line(f"no preview: {told['text']}", key="not_shot", data=told)
        finally:
            self.scanner.release()

    def _thresholds(self) -> Thresholds:
        return Thresholds() if self.sitting is None else preset_of(self.sitting.session).thresholds

    # What the capture loop reports, from its own thread.

    def _line(self, text: str) -> None:
        self.told.line(text)
        self._send_rows()

    def _session_changed(self) -> None:
        if self.sitting is not None:
            self._enter(self.sitting.session)
            self._take_settings()
        self._send_rows()

    def _send_rows(self) -> None:
        sitting = self.sitting
        if sitting is not None:
            self.told.rows(sitting.rows())

    def _loop_ended(self, error: BaseException | None) -> None:
        if error is not None:
            self.failed = problem_of(error)
            self.sitting = None
            self.scanner.release()
        self.told.all_changed()

    async def _watch(self) -> None:
        """Look at a session that another process writes to, while one is open and somebody looks."""
        while True:
            await asyncio.sleep(WATCH_S)
            sitting = self.sitting
            if sitting is not None and sitting.is_read_only and self.hub.count:
                with suppress(Exception):
                    await asyncio.to_thread(self._send_rows)
