"""Serves a canned station on a free port of this computer."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager
from http.server import BaseHTTPRequestHandler
from typing import Any
from urllib.parse import urlsplit

from oracles.console.answers import ANSWERS
from oracles.console.station import CannedStation
from oracles.local_server import local_server

# As the console's server sends it.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
    "connect-src 'self'; worker-src 'self' blob:; manifest-src 'self'; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'"
)


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # head and body of an answer are two writes
    station: CannedStation

    def do_GET(self) -> None:
        path = urlsplit(self.path).path
        if path == "/api/events":
            self._stream()
            return
        found = self.station.answer(path)
        file = None if found is not None else self.station.file(path)
        if found is not None:
            self._send(200, json.dumps(found).encode(), "application/json")
        elif file is not None:
            self._send(200, *file)
        else:
            self._send(404, json.dumps(self.station.missing(path)).encode(), "application/json")

    def do_PUT(self) -> None:
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.station.pressed.append((self.path, body))
        found = self.station.arrange(body) if self.path == "/api/leaves" else self.station.answer(self.path)
        self._send(200, json.dumps(found).encode(), "application/json")

    def do_POST(self) -> None:
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.station.pressed.append((self.path, body))
        made = ANSWERS["rule"] if self.path.startswith("/api/rules") else self.station.state
        made = self.station.arrange(body) if self.path == "/api/order" else made
        self._send(200, json.dumps(made).encode(), "application/json")

    def _send(self, status: int, body: bytes, kind: str) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Content-Security-Policy", POLICY)
        self.end_headers()
        self.wfile.write(body)

    def _stream(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Connection", "close")
        self.end_headers()
        for part in self.station.events():
            try:
                self.wfile.write(part)
            except OSError:  # the page has gone
                return

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: a test shows what failed."""


def serving(station: CannedStation) -> AbstractContextManager[str]:
    """Serve a canned station; gives its address."""
    return local_server(type("Handler", (_Handler,), {"station": station}))
