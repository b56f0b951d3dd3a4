"""Checks every request before a route sees it: who asks, and how much.

The order is that of the checks: the shape of the head, the host, the origin, the token, the length of the body, its
time, its type. A page of another origin can neither read (no CORS headers are ever sent) nor change anything (it has no
token); a name that an attacker lets point to this computer is not a known host (DNS rebinding). No cookie is set: a
browser sends it to every port of a host, and another user of this computer may serve one of them.
"""

from __future__ import annotations

import asyncio
import hmac
import json
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qs

from station.console.faults import ConsoleFault

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[MutableMapping[str, Any], Receive, Send], Awaitable[None]]

MAX_BODY_BYTES = 64 * 1024  # settings and notes are a few KiB
BODY_S = 10.0  # for a whole body, from this machine or the next room
SEND_S = 60.0  # for a client to take a part of an answer
MAX_HEAD_BYTES = 16 * 1024  # cookie, addresses and what browsers add are 2 KiB
MAX_TARGET_BYTES = 4096
SAFE = {"GET", "HEAD"}
METHODS = SAFE | {"POST", "PUT"}
OWN_SITES = {b"same-origin", b"none"}  # `Sec-Fetch-Site` of the page itself, and of an address that was typed
OPEN = ("/enter", "/")  # the first checks the token itself; the page holds nothing but the program
OPEN_BELOW = "/page/"
KEY = "key"  # in an address: of a picture, a stream, a file, which a browser asks for without headers
JSON = b"application/json"

CSP = "; ".join(
    [
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' data: blob:",
        "font-src 'self'",
        "connect-src 'self'",
        "worker-src 'self' blob:",
        "manifest-src 'self'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    ]
)
ALWAYS = [
    (b"content-security-policy", CSP.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"permissions-policy", b"camera=(), microphone=(), geolocation=()"),
]
NO_STORE = (b"cache-control", b"no-store")


@dataclass(frozen=True)
class Door:
    """What a request has to bring.

    hosts    names and ports by which the server is reached: `127.0.0.1:8765`.
    origin   scheme of its pages: `http` or `https`.
    token    of this start: `Authorization: Bearer`.
    """

    hosts: frozenset[str]
    scheme: str
    token: str

    @property
    def key(self) -> str:
        """What lets an address be read in place of the token, and nothing be changed."""
        return hmac.digest(self.token.encode(), b"addresses", "sha256").hex()

    @property
    def origins(self) -> frozenset[str]:
        """The origins of the console's own pages."""
        return frozenset(f"{self.scheme}://{host}" for host in self.hosts)

    def is_token(self, given: str) -> bool:
        """Whether a text is the token, in a time that does not depend on where it differs."""
        return _is_same(given, self.token)

    def is_key(self, given: str) -> bool:
        """Whether a text is the key, in the same way."""
        return _is_same(given, self.key)


def _is_same(given: str, secret: str) -> bool:
    return hmac.compare_digest(given.encode("utf-8", "surrogatepass"), secret.encode())


class Guard:
    """ASGI application in front of another one.

    It refuses, or hands a request with its whole body on.
    """

    def __init__(self, app: App, door: Door, *, body_s: float = BODY_S) -> None:
        self.inner, self._door, self._body_s = app, door, body_s

    async def __call__(self, scope: MutableMapping[str, Any], receive: Receive, send: Send) -> None:
        """Answer one request; other kinds of connections are handed on."""
        if scope["type"] != "http":
            await self.inner(scope, receive, send)
            return
        answer = _with_headers(send, is_api=scope["path"].startswith("/api/"))
        try:
            self._check(scope)
            body = await self._read_body(scope, receive)
        except ConsoleFault as fault:
            await _refuse(answer, fault, scope)
        else:
            await self.inner(scope, _Replay(body, receive), answer)

    def _check(self, scope: MutableMapping[str, Any]) -> None:
        headers = _Headers(scope["headers"])
        _check_head(scope, headers)
        self._check_host(headers.only(b"host"))
        self._check_origin(scope, headers)
        if scope["path"] not in OPEN and not scope["path"].startswith(OPEN_BELOW):
            self._check_token(scope, headers)
        if scope["method"] not in METHODS:
            raise ConsoleFault("method", f"{scope['method']} is not answered here", "use GET, POST or PUT")

    def _check_host(self, host: bytes | None) -> None:
        if not host:
            raise ConsoleFault("host", "the request names no host", status=400)
        if host.decode("latin-1").lower() not in self._door.hosts:
            raise ConsoleFault("host", "the host name is not this server", "open the link that planish serve printed")

    def _check_origin(self, scope: MutableMapping[str, Any], headers: _Headers) -> None:
        origin, site = headers.only(b"origin"), headers.only(b"sec-fetch-site")
        changes = scope["method"] not in SAFE
        foreign = origin is not None and origin.decode("latin-1").lower() not in self._door.origins
        from_page = site is not None and site.lower() not in OWN_SITES
        if foreign or (from_page and (changes or scope["path"].startswith("/api/"))):
            raise ConsoleFault("foreign_origin", "another page sent this request", "use the console's own page")

    def _check_token(self, scope: MutableMapping[str, Any], headers: _Headers) -> None:
        bearer = headers.bearer
        keys = parse_qs(scope["query_string"].decode("latin-1")).get(KEY) if scope["method"] in SAFE else None
        if bearer is None and not keys:
            raise ConsoleFault("no_token", "this browser has no token", "open the link that planish serve printed")
        if not (self._door.is_token(bearer) if bearer is not None else self._door.is_key("".join(keys or ()))):
            raise ConsoleFault(
                "wrong_token", "the token is that of another start", "open the link that planish serve printed last"
            )

    async def _read_body(self, scope: MutableMapping[str, Any], receive: Receive) -> bytes:
        headers = _Headers(scope["headers"])
        length = headers.only(b"content-length") or b"0"
        if int(length) > MAX_BODY_BYTES:
            raise _too_large()
        body = bytearray()
        try:
            async with asyncio.timeout(self._body_s):
                while True:
                    message = await receive()
                    body += message.get("body", b"")
                    if len(body) > MAX_BODY_BYTES:
                        raise _too_large()
                    if not message.get("more_body", False):
                        break
        except TimeoutError:
            raise ConsoleFault("timeout", f"the body took longer than {self._body_s:g} s", "send it again") from None
        kind = (headers.only(b"content-type") or b"").partition(b";")[0].strip().lower()
        if headers.only(b"content-encoding") or (body and kind != JSON):
            raise ConsoleFault("media_type", "the body is not plain JSON", "send application/json, not compressed")
        return bytes(body)


class _Headers:
    """The headers of a request."""

    def __init__(self, raw: Iterable[tuple[bytes, bytes]]) -> None:
        self._raw = list(raw)

    @property
    def size(self) -> int:
        return sum(len(name) + len(value) + 4 for name, value in self._raw)

    def all(self, name: bytes) -> list[bytes]:
        return [value for key, value in self._raw if key == name]

    def only(self, name: bytes) -> bytes | None:
        """Return the value of a header that may stand once.

        Raises ConsoleFault when it stands more often.
        """
        values = self.all(name)
        if len(values) > 1:
            raise ConsoleFault("header", f"the header {name.decode()} stands {len(values)} times")
        return values[0] if values else None

    @property
    def bearer(self) -> str | None:
        kind, _, token = (self.only(b"authorization") or b"").decode("latin-1").partition(" ")
        return token.strip() or None if kind.lower() == "bearer" else None


class _Replay:
    """The body as one message, then whatever the client does."""

    def __init__(self, body: bytes, receive: Receive) -> None:
        self._body: bytes | None = body
        self._receive = receive

    async def __call__(self) -> Message:
        if self._body is None:
            return await self._receive()
        body, self._body = self._body, None
        return {"type": "http.request", "body": body, "more_body": False}


def _check_head(scope: MutableMapping[str, Any], headers: _Headers) -> None:
    """Refuse heads that servers read differently: two lengths (RFC 9112, 6.3), odd targets."""
    if headers.size > MAX_HEAD_BYTES:
        raise ConsoleFault("header", "the head is too large", status=431)
    coded = headers.only(b"transfer-encoding")
    if coded is not None and headers.all(b"content-length"):
        raise ConsoleFault("header", "the request has two lengths")
    if coded is not None and scope["http_version"] == "1.0":
        raise ConsoleFault("header", "HTTP/1.0 has no transfer coding")
    target = scope["raw_path"] + scope["query_string"]
    if len(target) > MAX_TARGET_BYTES:
        raise ConsoleFault("header", "the address is too long", status=414)
    coded_path = scope["raw_path"].lower()
    if any(part in coded_path for part in (b"%00", b"%2f", b"%5c", b"%2e", b"\\", b"//", b"/../", b"/./")):
        raise ConsoleFault("not_found", "the address does not exist")


def _too_large() -> ConsoleFault:
    return ConsoleFault("too_large", f"the body is larger than {MAX_BODY_BYTES} bytes", "send less at a time")


def _with_headers(send: Send, *, is_api: bool) -> Send:
    """Return `send` with the headers of every answer and a limit on a client's time."""

    async def answer(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = list(message.get("headers", []))
            names = {name for name, _ in headers}
            extra = [NO_STORE] if is_api and b"cache-control" not in names else []
            message["headers"] = [*headers, *(header for header in [*ALWAYS, *extra] if header[0] not in names)]
        async with asyncio.timeout(SEND_S):
            await send(message)

    return answer


async def _refuse(send: Send, fault: ConsoleFault, scope: MutableMapping[str, Any]) -> None:
    """Answer with a fault and close the connection: what else was sent on it is not read."""
    is_page = not scope["path"].startswith("/api/") and fault.status == 401
    body = ENTER_PAGE if is_page else json.dumps(fault.body).encode()
    kind = b"text/html; charset=utf-8" if is_page else JSON
    headers = [(b"content-type", kind), (b"content-length", str(len(body)).encode()), (b"connection", b"close")]
    await send({"type": "http.response.start", "status": fault.status, "headers": headers})
    await send({"type": "http.response.body", "body": body, "more_body": False})


ENTER_PAGE = """<!doctype html>
<html lang="en">
<head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>Planish</title></head>
<body>
<h1>Planish</h1>
<p>Open the link that <code>planish serve</code> printed on the station: it changes with every start.</p>
<p lang="de">Öffnen Sie den Link, den <code>planish serve</code> an der Station ausgegeben hat: er gilt bis zum
nächsten Start.</p>
</body>
</html>
""".encode()
