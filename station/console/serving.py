"""The HTTP server: its socket, TLS, and an end that leaves nothing half done."""

from __future__ import annotations

import asyncio
import ipaddress
import resource
import secrets
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

import uvicorn

from drivers.safety.parking import run_parked
from restore.runtime import LibraryMissing, load_pymeshlab
from station.console.app import build_app
from station.console.http.connections import Connections
from station.console.http.guard import App, Door
from station.console.http.protocol import ConsoleProtocol
from station.console.state.app_state import AppState
from station.errors import UsageError

LOCALHOST = "127.0.0.1"
PORT = 8765
TOKEN_BYTES = 32
KEEP_ALIVE_S = 15
GRACE_S = 3  # for answers that are under way when the server ends
BACKLOG = 256
MAX_CONNECTIONS = 4000  # those of 32 tabs are 200
SPARE_FILES = 200  # descriptors for everything else


@dataclass(frozen=True)
class Address:
    """Where the server listens.

    cert, key: files of its TLS certificate, None on this machine.
    """

    host: str = LOCALHOST
    port: int = PORT
    cert: Path | None = None
    key: Path | None = None

    @property
    def scheme(self) -> str:
        """`http` or `https`."""
        return "http" if self.cert is None else "https"


def max_connections() -> int:
    """Return the number of connections that this process can take.

    A further one closes the one that has been silent longest.
    """
    allowed, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return MAX_CONNECTIONS if allowed < 0 else max(min(allowed - SPARE_FILES, MAX_CONNECTIONS), SPARE_FILES)


def check_address(address: Address) -> None:
    """Raise UsageError for an address that others reach without TLS."""
    if (address.cert is None) != (address.key is None):
        raise UsageError("--cert and --key go together", "name both files")
    if address.host in (LOCALHOST, "localhost", "::1"):
        return
    if address.cert is None:
        raise UsageError(f"--host {address.host}: others can read along", "give a certificate with --cert and --key")


def bind(address: Address) -> socket.socket:
    """Return the listening socket.

    Raises UsageError when the address cannot be used, or is not a single one.
    """
    family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((address.host, address.port))
        _refuse_everywhere(address, listener.getsockname()[0])
    except UsageError:
        listener.close()
        raise
    except OSError as error:
        listener.close()
        raise UsageError(
            f"cannot listen on {address.host}, port {address.port}: {error.strerror}",
            "another console may be running; choose another --port",
        ) from error
    return listener


def _refuse_everywhere(address: Address, bound: str) -> None:
    """Raise UsageError for a socket that is bound to every address.

    However that was written: `0`, `0x0`, nothing.
    """
    place = ipaddress.ip_address(bound.partition("%")[0])
    mapped = place.ipv4_mapped if isinstance(place, ipaddress.IPv6Address) else None
    if place.is_unspecified or (mapped is not None and mapped.is_unspecified):
        raise UsageError(
            f"--host {address.host!r}: that is every address",
            "name the one by which the tablet reaches this computer",
        )


def door_of(address: Address, port: int, token: str | None = None) -> Door:
    """What a request to this server has to bring. token: a new one by default."""
    shown = f"[{address.host}]" if ":" in address.host else address.host
    names = {shown.lower(), *({"localhost", LOCALHOST} if address.host == LOCALHOST else ())}
    usual = {"http": 80, "https": 443}[address.scheme]
    hosts = {f"{name}:{port}" for name in names} | (names if port == usual else set())
    return Door(frozenset(hosts), address.scheme, token or secrets.token_urlsafe(TOKEN_BYTES))


def link_of(address: Address, port: int, door: Door) -> str:
    """The link that opens the console."""
    host = f"[{address.host}]" if ":" in address.host else address.host
    return f"{address.scheme}://{host}:{port}/enter?token={door.token}"


def serve(app_state: AppState, address: Address, *, show: Callable[[str], None]) -> None:
    """Serve the web interface until a signal ends the process.

    show: prints the link when the server answers.
    Raises UsageError for the address, ScannerError when the scanner could not be parked.
    """
    check_address(address)
    with suppress(LibraryMissing):  # a layout that is asked for says so; here its threads may use it
        load_pymeshlab()
    listener = bind(address)
    with listener:
        port = listener.getsockname()[1]
        door = door_of(address, port)
        server = ConsoleServer(
            app_state, build_app(app_state, door), address, lambda: show(link_of(address, port, door))
        )
        run_parked(lambda: asyncio.run(server.serve(sockets=[listener])), [app_state.end])


class ConsoleServer(uvicorn.Server):
    """uvicorn's server with our protocol, whose end waits for the console's state."""

    def __init__(self, app_state: AppState, app: App, address: Address, ready: Callable[[], None]) -> None:
        config = uvicorn.Config(
            app,
            http=ConsoleProtocol,
            ws="none",
            loop="asyncio",
            lifespan="on",
            log_config=None,
            log_level="error",  # a damaged request is not an error of the server
            access_log=False,  # it would write the token of the link
            server_header=False,
            proxy_headers=False,
            timeout_keep_alive=KEEP_ALIVE_S,
            timeout_graceful_shutdown=GRACE_S,
            ssl_certfile=address.cert,
            ssl_keyfile=address.key,
        )
        super().__init__(config)
        self._desk, self._ready = app_state, ready
        self._accepting: list[asyncio.Task[None]] = []

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:  # noqa: ARG002 — a signal handler's
        """End after the current work.

        A second signal changes nothing, for the laser has to be off first.
        """
        self._captured_signals.append(sig)
        self.should_exit = True

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Take the closing of the terminal as the other signals."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        with super().capture_signals():
            before = signal.signal(signal.SIGHUP, self.handle_exit)
            try:
                yield
            finally:
                signal.signal(signal.SIGHUP, before)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to answer, then say so.

        Connections are accepted here, so uvicorn gets no socket.
        """
        await super().startup([])
        self._connections = Connections(self._make_protocol, max_connections(), self.config.ssl)
        for listener in sockets or ():
            listener.listen(BACKLOG)
            listener.setblocking(False)
            self._accepting.append(asyncio.create_task(self._connections.accept(listener)))
        self._ready()

    def _make_protocol(self) -> ConsoleProtocol:
        return ConsoleProtocol(
            config=self.config, server_state=self.server_state, app_state=self.lifespan.state, _loop=None
        )

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams first: they would be waited for."""
        for task in self._accepting:
            task.cancel()
        self._connections.end()
        self._desk.event_stream.end()
        await super().shutdown(sockets)
