"""All that the console works with: the scanner, the open session, who acts; and the state that it shows."""

from __future__ import annotations

import asyncio
import shutil
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import drivers
from restore import RangeScan
from station.config import StationConfig
from station.console import sessions
from station.console.actions import DO, ON_A_PAGE, SHOTS
from station.console.control import Control
from station.console.faults import ConsoleFault, problem_of
from station.console.hub import Hub
from station.console.preview import Preview, look_at
from station.console.scanner import Open, ScannerOwner
from station.console.sitting import Listener, Restorations, Sitting, Working
from station.session.history import redo_target, undo_target
from station.session.overview import missing_labels, preset_of
from station.session.presets import Thresholds
from station.session.store import Session, read_session, utc
from station.shift.workers import background
from station.version import software_version

STATE_S = 0.1  # at least, between two states that are sent
WATCH_S = 2.0  # between two looks at a session that another process writes to
SHOT_S = 20.0  # for a shot that is under way when the server ends: a FINE one takes four, with focus six
Enter = Callable[[Session], None]


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
        restorations: Restorations = background,
        hub: Hub | None = None,
    ) -> None:
        self.root, self.station = root, station
        self.hub = hub or Hub()
        self.control = Control(clock, now)
        self.scanner = ScannerOwner(config, self.changed, now, open_scanner)
        self._restorations = restorations
        self.sitting: Sitting | None = None
        self.failed: dict[str, str] | None = None
        self.preview: Preview | None = None
        self._enter, self._now = enter, now
        self._lock = threading.Lock()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._planned = False
        self._sent_rows: dict[int, dict[str, Any]] = {}
        self._watching: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Open the scanner, and send events from now on."""
        self._loop = asyncio.get_running_loop()
        self.hub.start()
        self._watching = asyncio.create_task(self._watch())
        if self.scanner.config is not None:
            self.scanner.connect()

    async def stop(self) -> None:
        """Send nothing more."""
        self.hub.end()
        self._loop = None
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

    # The open session.

    def open(self, name: str, *, read_only: bool = False) -> None:
        """Open a session, after closing the one that is open. Raises ConsoleFault, StationError, OSError."""
        with self._lock:
            folder = sessions.find(self.root, name)
            if self.sitting is not None:
                self._check_idle(self.sitting)
                self._close()
            self.failed = None
            self.sitting = self._watched(folder) if read_only else self._opened(folder)
        self.all_changed()

    def close(self) -> None:
        """Close the open session, if there is one. Raises ConsoleFault while a shot is under way."""
        with self._lock:
            if self.sitting is not None:
                self._check_idle(self.sitting)
            self._close()
        self.all_changed()

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
            raise ConsoleFault(
                "in_use", f"process {sitting.held_by} has this session", "end it there", held_by=sitting.held_by
            )
        return sitting

    def _opened(self, folder: Path) -> Working:
        shoot = None if self.scanner.config is None else self.scanner.capture
        listener = Listener(self._line, self._session_changed, self._shift_ended)
        sitting = Working(folder, shoot, listener, restorations=self._restorations)
        sitting.start()
        self._enter(sitting.session)
        return sitting

    def _watched(self, folder: Path) -> Sitting:
        holder = sessions.holder_of(folder)
        sitting = Sitting(folder, held_by=holder or "")
        sitting.rows()
        return sitting

    def _check_idle(self, sitting: Sitting) -> None:
        if not sitting.is_read_only and self.scanner.as_json()["busy"] == "shoot":
            raise ConsoleFault("session_open", "a page is being shot", "wait until it is stored")

    def _close(self) -> None:
        sitting, self.sitting = self.sitting, None
        self._sent_rows = {}
        if sitting is not None:
            sitting.close()

    def create(self, name: str, **fields: str) -> dict[str, Any]:
        """Make a session, and return its entry in the list. Raises ConsoleFault, UsageError, OSError."""
        with self._lock:
            folder = sessions.create(self.root, name, station=self.station, **fields)
        session = read_session(folder)
        self._enter(session)
        return sessions.entry_of(session, None)

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
            assert sitting.shift is not None
            try:
                DO[action](sitting.shift, page or 0, text or "")
            finally:
                if action in SHOTS:
                    self.scanner.release()

        sitting.do(task)
        return page

    def look(self) -> None:
        """Take a preview, and send it when it is there. Raises ConsoleFault."""
        self.scanner.reserve("preview")
        self.scanner.preview().add_done_callback(self._previewed)

    def _previewed(self, shot: Future[RangeScan]) -> None:
        try:
            scan = shot.result()
            seen = look_at(scan, self._thresholds())
            number = 1 if self.preview is None else int(self.preview.facts["n"]) + 1
            self.preview = replace(seen, facts={"n": number, "time": self._stamp(), **seen.facts, **_links(number)})
            self.hub.publish("preview", self.preview.facts)
        except Exception as error:  # of any kind: a preview ends nothing
            told = problem_of(error)
            line = {"text": f"no preview: {told['text']}", "key": "not_shot", "page": None, "data": told}
            self.hub.publish("message", line)
        finally:
            self.scanner.release()

    def _thresholds(self) -> Thresholds:
        return Thresholds() if self.sitting is None else preset_of(self.sitting.session).thresholds

    def _stamp(self) -> str:
        return self._now().isoformat(timespec="milliseconds").replace("+00:00", "Z")

    # What is shown.

    def state(self) -> dict[str, Any]:
        """The state as JSON values."""
        usage = shutil.disk_usage(self.root)
        sitting = self.sitting
        return {
            "version": software_version(),
            "time": self._stamp(),
            "scanner": self.scanner.as_json(),
            "session": None if sitting is None else _session_state(sitting),
            "recovery": None if sitting is None else sitting.recovery,
            "disk": {
                "free_bytes": usage.free,
                "total_bytes": usage.total,
                "shots_left": None if sitting is None else _shots_left(sitting, usage.free),
            },
            "control": self.control.as_json(),
            "jobs": [],
            "failed": self.failed,
        }

    def changed(self) -> None:
        """Send the state soon, from any thread; several changes are one event."""
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(self._plan)

    def all_changed(self) -> None:
        """Have the pages loaded anew."""
        self.hub.publish("pages", {})
        self.changed()

    def _plan(self) -> None:
        if not self._planned and self._loop is not None:
            self._planned = True
            self._loop.call_later(STATE_S, self._send_state)

    def _send_state(self) -> None:
        self._planned = False
        if not self.hub.count:
            return
        with suppress(OSError, ValueError):
            self.hub.publish("state", self.state())

    def _line(self, text: str) -> None:
        key, page = getattr(text, "key", "line"), getattr(text, "page", None)
        self.hub.publish("message", {"text": str(text), "key": key, "page": page, "data": {}})
        self.send_rows()

    def _session_changed(self) -> None:
        sitting = self.sitting
        if sitting is not None:
            self._enter(sitting.session)
        self.send_rows()

    def send_rows(self) -> None:
        """Send the rows that differ from those that were sent."""
        sitting = self.sitting
        if sitting is None:
            return
        rows = {row["page"]: row for row in sitting.rows()}
        before, self._sent_rows = self._sent_rows, rows
        if [*before] == [*rows][: len(before)]:
            for number, row in rows.items():
                if before.get(number) != row:
                    self.hub.publish("page", {"page": row})
        else:
            self.hub.publish("pages", {})
        self.changed()

    def _shift_ended(self, error: BaseException | None) -> None:
        if error is not None:
            self.failed = problem_of(error)
            self.sitting = None
            self.scanner.release()
        self.all_changed()

    async def _watch(self) -> None:
        """Look at a session that another process writes to, while one is open."""
        while True:
            await asyncio.sleep(WATCH_S)
            sitting = self.sitting
            if sitting is not None and sitting.is_read_only and self.hub.count:
                with suppress(Exception):
                    await asyncio.to_thread(self.send_rows)


def _links(number: int) -> dict[str, str]:
    return {"image": f"/api/preview/{number}.jpg", "overlay": f"/api/preview/{number}/overlay.png"}


def _session_state(sitting: Sitting) -> dict[str, Any]:
    session, rows = sitting.session, sitting.rows()
    volume, history = session.volume, session.history
    steps = {"undo": undo_target(history), "redo": redo_target(history)}
    numbers = {row["page"] for row in rows}
    return {
        "name": sitting.name,
        "id": session.identifier,
        "title": volume.title,
        "project": volume.project,
        "organisation": volume.organisation,
        "preset": volume.preset,
        "folder": str(sitting.folder),
        "read_only": sitting.is_read_only,
        "held_by": sitting.held_by or None,
        "events": len(history.events),
        "pages": len(rows),
        "current": sitting.page if sitting.page in numbers else None,
        "restoring": sitting.restoring,
        "missing": missing_labels(session),
        **{
            name: None if step is None else {"step": step.name, "page": step.page or None}
            for name, step in steps.items()
        },
    }


def _shots_left(sitting: Sitting, free: int) -> int | None:
    """How many further pages the disk takes, by the mean of those of the session; None before the first."""
    sizes = sitting.page_sizes()
    return int(free / (sum(sizes) / len(sizes))) if sizes and sum(sizes) else None
