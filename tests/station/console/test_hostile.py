"""Requests that are not the page's: each with the status that it gets."""

from __future__ import annotations

import asyncio
import gzip
import json
import socket
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack

import httpx

from station.console.http import guard
from station.console.http.guard import MAX_BODY_BYTES, MAX_HEAD_BYTES, MAX_TARGET_BYTES, Door, Guard
from station.console.http.protocol import ConsoleProtocol
from station.console.state.event_stream import MAX_STREAMS
from tests.station.conftest import curl_scan
from tests.station.console.conftest import WAIT_S, GatedScanner, Served, StandInRestorer, serving, wait_for

MANY_STREAMS = 5 * MAX_STREAMS  # `python -m bench.console` asks for 10,000
HOSTILE_BYTES = 200 * 1024 * 1024
Head = Callable[[Served], bytes]


def request(
    line: str = "GET /api/state HTTP/1.1",
    *,
    host: str | None = "127.0.0.1:{port}",
    bearer: str | None = "Bearer {token}",
    further: tuple[str, ...] = (),
    body: bytes = b"",
) -> Head:
    """A request with the right host and token, unless others are given, that closes its connection."""

    def build(served: Served) -> bytes:
        lines = [line, f"Host: {host}" if host is not None else None, f"Authorization: {bearer}" if bearer else None]
        lines += ["Connection: close", *further]
        values = {"port": served.port, "token": served.token, "key": served.guard._door.key}
        text = "".join(f"{one}\r\n" for one in lines if one is not None) + "\r\n"
        for name, value in values.items():
            text = text.replace("{" + name + "}", str(value))
        return text.encode("latin-1") + body

    return build


def change(*further: str, body: bytes = b"", origin: str | None = "http://127.0.0.1:{port}", **options: str) -> Head:
    """A POST that would take control."""
    lines = (f"Origin: {origin}",) if origin is not None else ()
    return request(
        options.get("line", "POST /api/control HTTP/1.1"),
        further=(*lines, *further),
        body=body,
        bearer=options.get("bearer", "Bearer {token}"),
    )


def sized(body: bytes, *further: str, **options: str) -> Head:
    kind = options.pop("kind", "application/json")
    return change(f"Content-Type: {kind}", f"Content-Length: {len(body)}", *further, body=body, **options)


GOOD_BODY = json.dumps({"tab": "b" * 16}).encode()
LONG = "x" * (MAX_TARGET_BYTES + 1)

# What is sent → the status that comes back.
TABLE: dict[str, tuple[Head, int]] = {
    "a good question": (request(), 200),
    "a good change": (sized(GOOD_BODY), 200),
    # Host: a name that is rebound to this computer, none, two.
    "a rebound name": (request(host="evil.example:{port}"), 421),
    "a rebound name without a port": (request(host="evil.example"), 421),
    "another port": (request(host="127.0.0.1:1"), 421),
    "a name that begins like ours": (request(host="127.0.0.1:{port}.evil.example"), 421),
    "no host": (request(host=None), 400),
    "an empty host": (request(host=""), 400),
    "two hosts": (request(further=("Host: 127.0.0.1:{port}",)), 400),
    "an address in the target": (request("GET http://evil.example/api/state HTTP/1.1"), 404),
    # Origin: other pages.
    "a foreign origin": (sized(GOOD_BODY, origin="http://evil.example"), 403),
    "the origin of a file": (sized(GOOD_BODY, origin="null"), 403),
    "our host with another scheme": (sized(GOOD_BODY, origin="https://127.0.0.1:{port}"), 403),
    "our host with another port": (sized(GOOD_BODY, origin="http://127.0.0.1:1"), 403),
    "two origins": (sized(GOOD_BODY, "Origin: http://evil.example"), 400),
    "a question with a foreign origin": (request(further=("Origin: http://evil.example",)), 403),
    "the events for a foreign page": (
        request("GET /api/events HTTP/1.1", further=("Sec-Fetch-Site: cross-site",)),
        403,
    ),
    "a picture in a foreign page": (request(further=("Sec-Fetch-Site: same-site",)), 403),
    "a foreign form": (sized(b"tab=x", origin="http://evil.example", kind="application/x-www-form-urlencoded"), 403),
    "a preflight": (request("OPTIONS /api/control HTTP/1.1", further=("Origin: http://evil.example",)), 403),
    # Token: none, old, cut short; as a password for programs.
    "no token": (request(bearer=None), 401),
    "an old token": (request(bearer="Bearer AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"), 401),
    "an empty token": (request(bearer="Bearer "), 401),
    "a token of other characters": (request(bearer="Bearer ÿÿ"), 401),
    "a token of another kind": (request(bearer="Basic {token}"), 401),
    "two tokens": (request(further=("Authorization: Bearer {token}",)), 400),
    "the token in a cookie": (request(bearer=None, further=("Cookie: planish-{port}={token}",)), 401),
    "a change with an empty token": (sized(GOOD_BODY, bearer="Bearer ", origin=None), 401),
    "a change with an empty token and the key": (
        sized(GOOD_BODY, bearer="Bearer ", line="POST /api/control?key={key} HTTP/1.1"),
        401,
    ),
    "an address with the key": (request("GET /api/state?key={key} HTTP/1.1", bearer=None), 200),
    "an address with another key": (request("GET /api/state?key=AAAA HTTP/1.1", bearer=None), 401),
    "an address with an empty key": (request("GET /api/state?key= HTTP/1.1", bearer=None), 401),
    "an address with two keys": (request("GET /api/state?key={key}&key={key} HTTP/1.1", bearer=None), 401),
    "an address with the token": (request("GET /api/state?key={token} HTTP/1.1", bearer=None), 401),
    "a change with the key": (sized(GOOD_BODY, bearer="", line="POST /api/control?key={key} HTTP/1.1"), 401),
    "the page, which is the program alone": (request("GET / HTTP/1.1", bearer=None), 404),
    "a wrong link": (request("GET /enter?token=wrong HTTP/1.1", bearer=None), 401),
    "a link without a token": (request("GET /enter HTTP/1.1", bearer=None), 401),
    "the right link": (request("GET /enter?token={token} HTTP/1.1", bearer=None), 303),
    "a change by a program": (sized(GOOD_BODY, origin=None), 200),
    # Paths.
    "two dots": (request("GET /page/../guard.py HTTP/1.1"), 404),
    "two dots, coded": (request("GET /page/%2e%2e/guard.py HTTP/1.1"), 404),
    "a slash, coded": (request("GET /page/..%2fguard.py HTTP/1.1"), 404),
    "a slash, coded twice": (request("GET /page/..%252fguard.py HTTP/1.1"), 404),
    "a backslash": (request("GET /page/..\\guard.py HTTP/1.1"), 404),
    "a backslash, coded": (request("GET /page/..%5cguard.py HTTP/1.1"), 404),
    "NUL": (request("GET /page/index.html%00.png HTTP/1.1"), 404),
    "an absolute path": (request("GET /page//etc/passwd HTTP/1.1"), 404),
    "a session above": (sized(b"{}", line="POST /api/sessions/../open HTTP/1.1"), 404),
    "a session elsewhere": (sized(b"{}", line="POST /api/sessions/..%2f..%2fetc/open HTTP/1.1"), 404),
    "no route": (request("GET /api/nothing HTTP/1.1"), 404),
    "an overlong code": (request("GET /page/%c0%ae%c0%ae/guard.py HTTP/1.1"), 404),
    "a long address": (request(f"GET /api/state?{LONG} HTTP/1.1"), 414),
    # Methods.
    "DELETE": (change(line="DELETE /api/state HTTP/1.1"), 405),
    "TRACE": (change(line="TRACE / HTTP/1.1"), 405),
    "CONNECT": (change(line="CONNECT / HTTP/1.1"), 405),
    "POST where GET is": (sized(b"{}", line="POST /api/state HTTP/1.1"), 405),
    "a question of the head alone": (request("HEAD /api/nothing HTTP/1.1"), 404),
    # Bodies.
    "a large body": (sized(b" " * (MAX_BODY_BYTES + 1)), 413),
    "a body that says it is large": (change("Content-Type: application/json", f"Content-Length: {HOSTILE_BYTES}"), 413),
    "a large body in chunks": (
        change("Transfer-Encoding: chunked", body=b"8000\r\n" + b" " * 0x8000 + b"\r\n" + b"8001\r\n" + b" " * 0x8001),
        413,
    ),
    "a zip bomb": (sized(gzip.compress(bytes(2**24)), "Content-Encoding: gzip"), 415),
    "a form": (sized(b"tab=x", kind="application/x-www-form-urlencoded"), 415),
    "text": (sized(GOOD_BODY, kind="text/plain"), 415),
    "no type": (change(f"Content-Length: {len(GOOD_BODY)}", body=GOOD_BODY), 415),
    "no JSON": (sized(b"{"), 422),
    "deep JSON": (sized(b"[" * 30000 + b"]" * 30000), 400),
    "NaN": (sized(b'{"tab": NaN}'), 422),
    "no UTF-8": (sized(b'{"tab": "\xff\xfe"}'), 400),
    "half a character": (sized(b'{"tab": "\\ud800aaaaaaaaaaaaaaaaa"}'), 422),
    "a field too many": (sized(b'{"tab": "bbbbbbbbbbbbbbbb", "admin": true}'), 422),
    # Heads that servers read in different ways (request smuggling).
    "two lengths": (change("Content-Length: 0", "Content-Length: 5", body=b"GET /"), 400),
    "a list of lengths": (change("Content-Length: 0, 5", body=b"GET /"), 400),
    "a length and chunks": (change("Content-Length: 5", "Transfer-Encoding: chunked", body=b"0\r\n\r\n"), 400),
    "a signed length": (change("Content-Length: +2", body=b"{}"), 400),
    "a negative length": (change("Content-Length: -1"), 400),
    "a length in words": (change("Content-Length: two"), 400),
    "an unknown coding": (change("Transfer-Encoding: xchunked", body=b"0\r\n\r\n"), 501),
    "a coding after chunks": (change("Transfer-Encoding: chunked, identity", body=b"0\r\n\r\n"), 501),
    "a blank before the colon": (request(further=("Content-Length : 5",)), 400),
    "a folded header": (request(further=("X-One: 1\r\n 2",)), 200),
    "a header without a colon": (request(further=("nonsense",)), 400),
    "NUL in a header": (request(further=("X-One: a\0b",)), 400),
    "a chunk that is none": (
        change("Transfer-Encoding: chunked", "Content-Type: application/json", body=b"zz\r\n"),
        400,
    ),
    "a large head": (request(further=("X-One: " + "x" * 2 * MAX_HEAD_BYTES,)), 431),
    "many headers": (request(further=tuple(f"X-{i}: 1" for i in range(5000))), 431),
    # Versions.
    "HTTP/1.0": (request("GET /api/state HTTP/1.0"), 200),
    "HTTP/1.0 without a host": (request("GET /api/state HTTP/1.0", host=None), 400),
    "HTTP/1.0 in chunks": (
        change("Transfer-Encoding: chunked", line="POST /api/control HTTP/1.0", body=b"0\r\n\r\n"),
        400,
    ),
    "HTTP/0.9": (lambda _served: b"GET /api/state\r\n\r\n", 400),
    "HTTP/2 at once": (lambda _served: b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 400),
    "TLS": (lambda _served: bytes.fromhex("16030100050100000100") + b"\r\n\r\n", 400),
    "a WebSocket": (
        request(
            "GET /api/events HTTP/1.1",
            further=(
                "Upgrade: websocket",
                "Connection: Upgrade",
                "Sec-WebSocket-Version: 13",
                "Origin: http://evil.example",
            ),
        ),
        403,
    ),
}


def status_of(answer: bytes) -> int:
    return int(answer.split(b" ", 2)[1]) if answer.startswith(b"HTTP/1.1 ") else 0


def test_what_is_sent_gets_its_status(served):
    assert {name: status_of(served.say(head(served))) for name, (head, _) in TABLE.items()} == {
        name: status for name, (_, status) in TABLE.items()
    }
    with served.client() as browser:  # which is answered as before
        assert browser.get("/api/state").status_code == 200
    assert served.app_state.event_stream.count == 0


def test_refusals_name_themselves_and_let_no_other_page_read(served, client):
    answer = client.get("/api/state", headers={"Origin": "http://evil.example"})
    assert answer.json()["error"]["key"] == "foreign_origin"
    for one in (answer, client.get("/api/state"), client.get("/api/nothing"), client.get("/page/nothing.js")):
        assert one.headers["content-security-policy"] == guard.CSP
        assert one.headers["x-content-type-options"] == "nosniff"
        assert "access-control-allow-origin" not in one.headers
        assert "http" not in guard.CSP
    assert client.get("/api/state").headers["cache-control"] == "no-store"


def test_no_cookie_is_set_that_a_browser_would_send_to_other_ports(served, client):
    """What the link gives stays behind the `#` of the page's own address, which is sent to no server."""
    answer = client.get(f"/enter?token={served.token}")
    assert "set-cookie" not in answer.headers
    path, _, behind = answer.headers["location"].partition("#")
    assert path == "/"
    given = dict(part.split("=") for part in behind.split("&"))
    assert given["token"] == served.token
    assert served.token not in given["key"]
    with httpx.Client(base_url=served.origin, trust_env=False, timeout=WAIT_S) as browser:
        assert browser.get("/api/state", params={"key": given["key"]}).status_code == 200
        assert browser.get("/api/state").status_code == 401


def test_two_requests_in_one_are_two_answers_or_none(served):
    """What follows a refused request on its connection is not read: it may be meant for another server."""
    refused = change("Content-Length: 5", "Transfer-Encoding: chunked", body=b"0\r\n\r\n")(served)
    good = request()(served)
    assert served.say(refused + good).count(b"HTTP/1.1 ") == 1
    assert served.say(good.replace(b"Connection: close\r\n", b"") + good).count(b"HTTP/1.1 200") == 2


def test_a_slow_head_is_given_up(served, monkeypatch):
    monkeypatch.setattr(ConsoleProtocol, "head_s", 0.2)
    assert status_of(served.say(b"GET /api/state HTTP/1.1\r\nHost: ")) == 408
    assert status_of(served.say(b"")) == 408


def test_a_slow_second_head_is_given_up_as_well(served, monkeypatch):
    monkeypatch.setattr(ConsoleProtocol, "head_s", 0.2)
    good = request()(served).replace(b"Connection: close\r\n", b"")
    answer = served.say(good + b"GET /api/st")
    assert answer.count(b"HTTP/1.1 200") == 1
    assert answer.count(b"HTTP/1.1 408") == 1


def test_a_slow_body_is_given_up(served, monkeypatch):
    monkeypatch.setattr(served.guard, "_body_s", 0.2)
    head = change("Content-Type: application/json", "Content-Length: 30", body=b'{"tab":')
    assert status_of(served.say(head(served))) == 408


def test_silent_connections_make_room_for_new_ones(root, monkeypatch):
    """The one silent longest is closed; those that are being answered, and the open ones of a browser, stay."""
    monkeypatch.setattr("station.console.serving.max_connections", lambda: 20)
    monkeypatch.setattr(ConsoleProtocol, "head_s", WAIT_S)
    with serving(root, GatedScanner(curl_scan()), StandInRestorer()) as served, ExitStack() as lines:
        stream = lines.enter_context(socket.create_connection(("127.0.0.1", served.port), WAIT_S))
        stream.sendall(request("GET /api/events HTTP/1.1")(served))
        assert status_of(stream.recv(4096)) == 200
        browser = lines.enter_context(served.client())
        browser.get("/api/state")
        silent = [lines.enter_context(socket.create_connection(("127.0.0.1", served.port))) for _ in range(100)]
        assert silent[0].recv(1) == b""
        assert browser.post("/api/sessions/missale/open").status_code == 200
        with served.client() as newcomer:
            assert newcomer.get("/api/state").status_code == 200
        heard = b""
        while b"missale" not in heard:  # fails by the stream's own timeout
            heard += stream.recv(65536)


def test_clients_that_do_not_read_are_let_go(served, monkeypatch):
    """An answer that nobody takes ends its connection, not the server."""
    monkeypatch.setattr(guard, "SEND_S", 0.2)
    with socket.create_connection(("127.0.0.1", served.port)) as line:
        line.sendall(request("GET /api/openapi.json HTTP/1.1")(served) * 50)
        line.recv(1)
    with served.client() as browser:
        assert browser.get("/api/state").status_code == 200


def test_streams_beyond_their_number_take_no_place_of_other_requests(served):
    """They are refused and let go, while their clients hold on to them."""
    lines = []
    try:
        for _ in range(MANY_STREAMS):
            lines.append(socket.create_connection(("127.0.0.1", served.port), WAIT_S))
            lines[-1].sendall(request("GET /api/events HTTP/1.1")(served).replace(b"Connection: close\r\n", b""))
        heads = [line.recv(4096) for line in lines]
        assert Counter(map(status_of, heads)) == {200: MAX_STREAMS, 503: MANY_STREAMS - MAX_STREAMS}
        refused = [line for line, head in zip(lines, heads, strict=True) if status_of(head) == 503]
        assert all(map(_is_closed, refused))
        with served.client() as browser:
            assert browser.get("/api/state").status_code == 200
    finally:
        for line in lines:
            line.close()
    wait_for(lambda: served.app_state.event_stream.count == 0, "the end of the streams")


def _is_closed(line: socket.socket) -> bool:
    """Whether the server closes a connection after its answer, instead of waiting for another request."""
    line.settimeout(WAIT_S)
    while line.recv(4096):
        pass
    return True


def test_a_guard_compares_whole_tokens():
    door = Door(frozenset({"a:1"}), "http", "secret")
    assert door.is_token("secret")
    assert not any(door.is_token(other) for other in ("", "secre", "secret ", "SECRET", "sécret", "\udcff"))
    assert door.is_key(door.key)
    assert not any(door.is_key(other) for other in ("", "secret", door.key[:-1], door.key.upper()))


def test_other_kinds_of_connections_pass_the_guard():
    seen = []

    async def app(scope, receive, send):
        seen.append(scope["type"])

    asyncio.run(Guard(app, Door(frozenset(), "http", "t"))({"type": "lifespan"}, None, None))
    assert seen == ["lifespan"]
