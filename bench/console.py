"""`python -m bench.console [--short]`: the console's server as its browsers meet it.

Starts `planish serve` before the simulated station, in a folder of its own, and prints: how long until it answers; what
an idle server with one page open takes of a core; the time from the shutter to the verdict beside that of the shot;
how long corrections take while many pages are due; what 10,000 streams of events that are kept open at once get, and
what other requests get meanwhile; what schemathesis finds.
"""

from __future__ import annotations

import asyncio
import json
import re
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import psutil

from oracles.tiny_scan import tiny_scan
from restore import PageEdits
from station.console.state.open_session import Listener, WritableSession
from station.session import Volume, add_scan, correct, create_session, open_session
from station.session.derivation.restoration import Run

TAB = "b" * 16
IDLE_S = 30.0
PAGES = 3  # the first one loads what the others find loaded
STREAMS = 10_000
AT_A_TIME = 200  # that wait for an answer: what the system's queue for connections takes
WAIT_S = 300.0
POLL_S = 0.1
DUE, DECISIONS = 3000, 40  # pages of a session that is opened, and corrections of some of them
SPARE = 500  # descriptors for everything else
MAX_EXAMPLES = 200  # for each operation


@dataclass(frozen=True)
class Station:
    """A server that runs: its process, its address, its token, a browser that has the link open."""

    process: psutil.Popen
    base: str
    token: str
    browser: httpx.Client


@contextmanager
def served(root: Path) -> Iterator[tuple[Station, float]]:
    """A server before the simulated station, and the seconds until it answered."""
    command = [sys.executable, "-m", "station", "serve", str(root), "--config", "simulated", "--port", "0"]
    start = time.perf_counter()
    with psutil.Popen([*command, "--index", str(root / "index")], stdout=subprocess.PIPE, text=True) as process:
        link = process.stdout.readline().strip()
        base, _, token = link.partition("/enter?token=")
        with httpx.Client(
            base_url=base,
            headers={"Origin": base, "X-Planish-Tab": TAB, "Authorization": f"Bearer {token}"},
            timeout=WAIT_S,
            trust_env=False,
        ) as browser:
            browser.get("/api/state").raise_for_status()
            answered = time.perf_counter() - start
            while browser.get("/api/state").json()["scanner"]["busy"]:  # it is being opened
                time.sleep(POLL_S)
            try:
                yield Station(process, base, token, browser), answered
            finally:
                process.terminate()
                process.wait(WAIT_S)


def main(*, short: bool = False) -> None:
    """Print every figure."""
    with tempfile.TemporaryDirectory() as name, served(Path(name)) as (station, answered):
        print(f"first answer            {answered:6.2f} s after the start")
        station.browser.post("/api/sessions", json={"name": "bench", "title": "Bench"}).raise_for_status()
        station.browser.post("/api/sessions/bench/open").raise_for_status()
        shots(station)
        idle(station)
        decisions(DUE // 10 if short else DUE)
        asyncio.run(many_streams(station, STREAMS // 10 if short else STREAMS))
        if not short:
            asked(station)


def shots(station: Station) -> None:
    """Print for each page: seconds of the shot until it is stored, and from there to the verdict."""
    for page in range(1, PAGES + 1):
        seen: dict[str, float] = {}
        ready, done = threading.Event(), threading.Event()
        listener = threading.Thread(target=listen, args=(station, seen, ready, done))
        listener.start()
        ready.wait(WAIT_S)
        start = time.perf_counter()
        station.browser.post("/api/press", json={"action": "capture"}).raise_for_status()
        done.wait(WAIT_S)
        listener.join()
        shot, verdict = seen["stored"] - start, seen["verdict"] - start
        print(
            f"page {page}: shot and stored {shot:6.2f} s, verdict after {verdict:6.2f} s: {verdict - shot:5.2f} s more"
        )


def listen(station: Station, seen: dict[str, float], ready: threading.Event, done: threading.Event) -> None:
    """Note when each kind of line comes, until the verdict."""
    with station.browser.stream("GET", f"/api/events?tab={TAB}") as answer:
        for line in answer.iter_lines():
            ready.set()
            if line.startswith("data: ") and '"key"' in line:
                seen.setdefault(json.loads(line[6:]).get("key", ""), time.perf_counter())
            if "verdict" in seen:
                done.set()
                return


def idle(station: Station) -> None:
    """Print the share of a core that the server takes while a page is open and nothing happens."""
    with station.browser.stream("GET", f"/api/events?tab={TAB}"):
        time.sleep(2.0)
        family = [station.process, *station.process.children(recursive=True)]
        before, start = sum(used(one) for one in family), time.perf_counter()
        time.sleep(IDLE_S)
        share = (sum(used(one) for one in family) - before) / (time.perf_counter() - start)
    print(f"idle, one page open     {share:6.2%} of a core over {IDLE_S:.0f} s, {len(family)} processes")


def decisions(pages: int) -> None:
    """Print how long corrections take while many pages are due, each of which is restored at once."""
    with tempfile.TemporaryDirectory() as name:
        folder, scan, seconds = Path(name) / "waiting", tiny_scan(1), list[float]()
        create_session(folder, Volume(title="Waiting"))
        with open_session(folder) as writer:
            for _ in range(pages):
                add_scan(writer, scan, facts={})
        listener = Listener(lambda _line: None, lambda: None, lambda _error: None)
        opened = WritableSession(folder, None, listener, restorations=lambda: nullcontext(restored_at_once))
        opened.start()
        for number in range(1, DECISIONS + 1):
            page, edits, start = number * pages // DECISIONS, PageEdits(kind="plate"), time.perf_counter()
            opened.change(partial(correct, page=page, edits=edits))
            seconds.append(time.perf_counter() - start)
        left = len(opened.restoring)
        opened.close()
    first, later = seconds[0], sorted(seconds[1:])
    p50, p95 = (later[int(part * (len(later) - 1))] for part in (0.5, 0.95))
    print(
        f"corrections, {pages} due   the first {first:.2f} s, then p50 {p50:.3f} s, p95 {p95:.3f} s, "
        f"worst {later[-1]:.3f} s; {left} pages are left"
    )


def restored_at_once(_source: Path, _parameters: Mapping[str, Any], folder: Path) -> Future[Run]:
    """Return the result of a scan that cannot be restored."""
    future = Future[Run]()
    folder.mkdir()
    future.set_result(Run({"error": "no surface", "hint": ""}))
    return future


def used(process: psutil.Process) -> float:
    """Seconds of a processor that a process has used."""
    times = process.cpu_times()
    return times.user + times.system


async def many_streams(station: Station, count: int) -> None:
    """Ask for many streams and keep every one open; print what they got, and what other requests get meanwhile."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    count = min(count, most - SPARE)
    gate = asyncio.Semaphore(AT_A_TIME)

    async def one() -> tuple[str, asyncio.StreamWriter]:
        async with gate:
            return await stream(station)

    others = Others(station)
    memory, start = station.process.memory_info().rss, time.perf_counter()
    asking = asyncio.create_task(others.ask())
    lines = await asyncio.gather(*(one() for _ in range(count)), return_exceptions=True)
    asking.cancel()
    seconds = time.perf_counter() - start
    kept = [line for line in lines if not isinstance(line, BaseException)]
    for _, writer in kept:
        writer.close()
    got = dict(Counter(status for status, _ in kept) + Counter({"not connected": count - len(kept)}))
    after = station.browser.get("/api/state").status_code
    grown = (others.memory - memory) / 2**20
    print(f"{count} streams at once   {got} in {seconds:.1f} s; memory {grown:+.1f} MiB at most; then {after}")
    print(f"other requests meanwhile  {dict(others.got)}, the slowest took {others.slowest:.2f} s")


@dataclass
class Others:
    """Requests for the state on new connections, one after the other, and the largest memory of the server."""

    station: Station
    got: Counter[str] = field(default_factory=Counter)
    slowest: float = 0.0
    memory: int = 0

    async def ask(self) -> None:
        """Ask until it is cancelled."""
        while True:
            start = time.perf_counter()
            status, writer = await stream(self.station, "/api/state")
            writer.close()
            self.got[status] += 1
            self.slowest = max(self.slowest, time.perf_counter() - start)
            self.memory = max(self.memory, self.station.process.memory_info().rss)
            await asyncio.sleep(POLL_S)


async def stream(station: Station, path: str = "/api/events") -> tuple[str, asyncio.StreamWriter]:
    """Ask for the events, or for something else; returns the status of the answer, and the connection, still open."""
    host, _, port = station.base.removeprefix("http://").partition(":")
    reader, writer = await asyncio.open_connection(host, int(port))
    head = f"GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\nAuthorization: Bearer {station.token}\r\n\r\n"
    writer.write(head.encode())
    async with asyncio.timeout(WAIT_S):
        line = await reader.readline()
    return (line.split(b" ")[1].decode() if line else "closed"), writer


def asked(station: Station) -> None:
    """Print what schemathesis finds in all routes, as another program would use them."""
    command = [
        sys.executable, "-m", "schemathesis.cli", "run", f"{station.base}/api/openapi.json",
        "--header", f"Authorization: Bearer {station.token}", "--checks", "not_a_server_error",
        "--exclude-path", "/api/events", "--max-examples", str(MAX_EXAMPLES), "--mode", "all", "--no-color",
        "--phases", "examples,coverage,fuzzing",
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = [
        line
        for line in done.stdout.splitlines()
        if re.search(r"Operations|Test cases|passed|failures|errors|No ", line)
    ]
    print(
        "schemathesis            " + "; ".join(" ".join(line.split()) for line in lines[-6:]),
        f"(exit {done.returncode})",
    )


if __name__ == "__main__":
    main(short="--short" in sys.argv[1:])
