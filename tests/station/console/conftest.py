"""A console that is served on a free port, before a scanner and a restorer that do what a test wants."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from drivers.scanner import Progress
from drivers.vivid900.settings import VividSettings
from restore import RangeScan
from station.config import StationConfig
from station.console.app import build_app
from station.console.http.files import list_page
from station.console.serving import Address, ConsoleServer, bind, door_of
from station.console.state.app_state import AppState
from station.session import Volume, create_session
from station.session.derivation.restoration import Run
from station.session.derivation.service import Submit
from station.session.terms.presets import load_preset
from station.verdict.same_page import fingerprint
from tests.station.conftest import GOOD, curl_scan

WAIT_S = 90.0  # for what the server does in its threads: milliseconds, on a machine with time
TAB = "a" * 16


def wait_for(condition: Callable[[], Any], what: str = "it", *, within: float | None = None) -> Any:
    """The first true value of a condition. Fails after a number of seconds, WAIT_S by default."""
    limit = WAIT_S if within is None else within
    deadline = time.monotonic() + limit
    while not (found := condition()):
        if time.monotonic() > deadline:
            pytest.fail(f"{what} did not come within {limit:g} s")
        time.sleep(0.01)
    return found


@dataclass
class GatedScanner:
    """A scanner whose shots wait at a gate. laser: whether it is on; shots: what was asked for.

    places: to which its leaves were turned.
    """

    scan: RangeScan
    fault: BaseException | None = None
    laser: bool = False
    closed: int = 0
    shots: list[VividSettings] = field(default_factory=list)
    places: list[tuple[int, int]] = field(default_factory=list)
    gate: threading.Event = field(default_factory=threading.Event)
    in_shot: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        self.gate.set()

    def turn_to(self, opening: int, attempt: int) -> None:
        self.places.append((opening, attempt))

    def capture(self, settings: VividSettings, progress: Progress) -> RangeScan:
        self.shots.append(settings)
        self.laser = True
        try:
            progress("scan", 0.5)
            self.in_shot.set()
            while not self.gate.wait(0.05):
                progress("scan", 0.6)
            if self.fault is not None:
                raise self.fault
            return self.scan
        finally:
            self.laser = False

    def close(self) -> None:
        self.closed += 1
        self.laser = False

    def __enter__(self) -> GatedScanner:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@dataclass
class StandInRestorer:
    """Restores in a thread when its gate is open. drawn: which page all look like; each looks otherwise without it."""

    measures: dict[str, float] = field(default_factory=lambda: dict(GOOD))
    calls: list[Mapping[str, Any]] = field(default_factory=list)
    gate: threading.Event = field(default_factory=threading.Event)
    fault: BaseException | None = None
    drawn: int | None = None

    def __post_init__(self) -> None:
        self.gate.set()

    @contextmanager
    def __call__(self) -> Iterator[Submit]:
        threads: list[threading.Thread] = []

        def submit(source: Path, parameters: Mapping[str, Any], folder: Path) -> Future[Run]:
            future: Future[Run] = Future()
            self.calls.append(parameters)
            threads.append(threading.Thread(target=self._finish, args=(future, folder, len(self.calls))))
            threads[-1].start()
            return future

        try:
            yield submit
        finally:
            self.gate.set()
            for thread in threads:
                thread.join()

    def _finish(self, future: Future[Run], folder: Path, number: int) -> None:
        self.gate.wait()
        if self.fault is not None:
            future.set_exception(self.fault)
            return
        picture = np.random.default_rng(self.drawn or number).integers(0, 256, (200, 200, 3), np.uint8)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "page.png").write_bytes(bytes([number]))
        measures = {**self.measures, "fingerprint": fingerprint(picture)}
        result = {"page_mm": [120.0, 80.0], "dpi": 150.0, "measures": measures}
        future.set_result(Run(result, {"seconds": {"total": 1.0}}))


@dataclass
class Served:
    """A console that answers, and what it works with."""

    app_state: AppState
    port: int
    token: str
    scanner: GatedScanner
    restorer: StandInRestorer
    root: Path
    guard: Any
    address: Address

    @property
    def origin(self) -> str:
        return f"{self.address.scheme}://{self.address.host}:{self.port}"

    def client(self, tab: str = TAB) -> httpx.Client:
        """A browser that has opened the link."""
        headers = {"Origin": self.origin, "X-Planish-Tab": tab, "Authorization": f"Bearer {self.token}"}
        return httpx.Client(base_url=self.origin, headers=headers, timeout=WAIT_S, trust_env=False)

    def say(self, data: bytes, *, timeout: float = WAIT_S) -> bytes:
        """What comes back for some bytes, until the server closes the connection."""
        with socket.create_connection(("127.0.0.1", self.port), timeout) as line:
            line.sendall(data)
            parts = []
            while part := line.recv(65536):
                parts.append(part)
        return b"".join(parts)


CONFIG = StationConfig(scanner={"driver": "simulated", "lens": "MIDDLE"})


@contextmanager
def serving(
    root: Path,
    scanner: GatedScanner,
    restorer: StandInRestorer,
    *,
    config: StationConfig | None = CONFIG,
    page: Path | None = None,
    address: Address = Address(port=0),  # noqa: B008 — frozen
    **options: Any,
) -> Iterator[Served]:
    """A console for a folder of sessions, ended with the block. options: of its state."""
    app_state = AppState(root, config, open_scanner=lambda _config: scanner, restorations=restorer, **options)
    with bind(address) as listener:
        port = listener.getsockname()[1]
        door = door_of(address, port)
        ready = threading.Event()
        guard = build_app(app_state, door, {} if page is None else list_page(page))
        server = ConsoleServer(app_state, guard, address, ready.set)
        thread = threading.Thread(target=lambda: asyncio.run(server.serve(sockets=[listener])))
        thread.start()
        try:
            assert ready.wait(WAIT_S)
            wait_for(lambda: app_state.scanner.as_json()["busy"] is None, "the scanner")
            yield Served(app_state, port, door.token, scanner, restorer, root, guard, address)
        finally:
            server.should_exit = True
            thread.join()
            scanner.gate.set()
            app_state.end()


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A folder with one session, `missale`."""
    settings = load_preset("book").model_dump(mode="json", exclude_none=True)
    create_session(tmp_path / "missale", Volume(title="Missale", project="P 12", preset_values=settings))
    return tmp_path


@pytest.fixture
def served(root: Path) -> Iterator[Served]:
    """A console before a stand-in scanner, no session open."""
    with serving(root, GatedScanner(curl_scan()), StandInRestorer()) as found:
        yield found


@pytest.fixture
def client(served: Served) -> Iterator[httpx.Client]:
    """A browser at that console."""
    with served.client() as browser:
        yield browser


@pytest.fixture
def opened(client: httpx.Client) -> httpx.Client:
    """A browser with the session open."""
    assert client.post("/api/sessions/missale/open").status_code == 200
    return client
