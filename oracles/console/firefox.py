"""The system's Firefox by WebDriver BiDi, which it speaks itself: no driver is needed.

W3C, WebDriver BiDi (working draft): a WebSocket that takes commands {id, method, params} and sends results and events.
"""

from __future__ import annotations

import itertools
import json
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

NAMES = ("firefox-esr", "firefox")
WHOLE_S = 420.0  # for all that one browser does, on a machine with many at work: no wait goes beyond it
POLL_S, END_S = 0.1, 20.0
LISTENING = re.compile(r"WebDriver BiDi listening on (ws://\S+)")
# Nothing is fetched but the console; the first window opens without questions.
PREFERENCES = {
    "app.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "toolkit.telemetry.enabled": False,
    "services.settings.server": "data:,",
}


def find_firefox() -> str | None:
    """The path of the system's Firefox, None when it has none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


@dataclass
class Deadline:
    """The end of a number of seconds from now on."""

    seconds: float
    end: float = field(init=False)

    def __post_init__(self) -> None:
        self.end = time.monotonic() + self.seconds

    def left(self, what: str) -> float:
        """Seconds that are left. Raises TimeoutError, which names what is waited for, when there are none."""
        if (seconds := self.end - time.monotonic()) <= 0:
            raise TimeoutError(f"not within {self.seconds:g} s: {what}")
        return seconds


@dataclass
class Firefox:
    """A Firefox with one tab."""

    line: ClientConnection
    deadline: Deadline
    tab: str = ""
    numbers: Iterator[int] = field(default_factory=lambda: itertools.count(1))

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The result of a command. Raises RuntimeError for an error, TimeoutError."""
        number = next(self.numbers)
        self.line.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while (message := json.loads(self.line.recv(timeout=self.deadline.left(method)))).get("id") != number:
            pass  # an event
        if message["type"] == "error":
            raise RuntimeError(f"{method}: {message['message']}")
        return dict(message["result"])

    def go(self, address: str) -> None:
        """Open an address, and wait until it is loaded."""
        self.ask("browsingContext.navigate", context=self.tab, url=address, wait="complete")

    def evaluate(self, script: str) -> Any:
        """The value of an expression on the page. Raises RuntimeError for one that throws."""
        found = self.ask("script.evaluate", expression=script, target={"context": self.tab}, awaitPromise=True)
        if found["type"] == "exception":
            raise RuntimeError(found["exceptionDetails"]["text"])
        return found["result"].get("value")

    def wait_for(self, script: str) -> Any:
        """The first true value of an expression on the page. Raises TimeoutError."""
        while not (found := self.evaluate(script)):
            time.sleep(min(POLL_S, self.deadline.left(script)))
        return found

    def press(self, key: str) -> None:
        """Press and release a key."""
        strokes = [{"type": kind, "value": key} for kind in ("keyDown", "keyUp")]
        self._act("key", strokes)

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        """Press the mouse at a place of the window, px, and release it at another one."""
        places = [{"type": "pointerMove", "x": x, "y": y} for x, y in (start, end)]
        self._act(
            "pointer", [places[0], {"type": "pointerDown", "button": 0}, places[1], {"type": "pointerUp", "button": 0}]
        )

    def _act(self, kind: str, actions: list[dict[str, Any]]) -> None:
        self.ask("input.performActions", context=self.tab, actions=[{"type": kind, "id": kind, "actions": actions}])


@contextmanager
def firefox(program: str) -> Iterator[Firefox]:
    """A headless Firefox with a profile of its own; it is ended with the block, if need be by force."""
    deadline = Deadline(WHOLE_S)
    with tempfile.TemporaryDirectory(prefix="firefox-", ignore_cleanup_errors=True) as profile:
        lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in PREFERENCES.items()]
        (Path(profile) / "user.js").write_text("\n".join(lines))
        log = Path(profile) / "log"
        command = [program, "--headless", "--no-remote", "--profile", profile, "--remote-debugging-port", "0"]
        with log.open("wb") as out:
            process = subprocess.Popen(command, stdout=out, stderr=out)
        try:
            address = f"{_address(log, deadline)}/session"
            with connect(address, max_size=None, open_timeout=END_S, close_timeout=1, proxy=None) as line:
                browser = Firefox(line, deadline)
                browser.ask("session.new", capabilities={})
                browser.tab = browser.ask("browsingContext.getTree")["contexts"][0]["context"]
                yield browser
        finally:
            _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _address(log: Path, deadline: Deadline) -> str:
    while not (found := LISTENING.search(log.read_text("utf-8", "replace"))):
        time.sleep(min(POLL_S, deadline.left(f"the start of Firefox: {log.read_text('utf-8', 'replace')[-300:]}")))
    return found[1]
