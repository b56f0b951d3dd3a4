"""Five thousand connections that send nothing, while a page is captured: it is stored, and so is every change."""

from __future__ import annotations

import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest

from station.session import read_session
from station.session.fixity.verify import verify
from tests.station.console.conftest import WAIT_S, wait_for
from tests.station.console.test_tls import ADDRESS, Files, files  # noqa: F401 — a fixture

SILENT = 5000
DESCRIPTORS = 1024  # what most systems allow a process
FLOOD = """
import resource, socket, sys, time
resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
lines = []
while len(lines) < {silent}:
    try:
        lines.append(socket.create_connection(({host!r}, {port}), 30))
    except OSError:
        time.sleep(0.01)
    if len(lines) % 1000 == 0:
        print(len(lines), flush=True)
print("open", flush=True)
sys.stdin.read()
"""
SERVE = "import resource, runpy, sys; resource.setrlimit(resource.RLIMIT_NOFILE, ({limit},) * 2); " \
    "sys.argv[0] = 'planish'; runpy.run_module('station', run_name='__main__')"  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("tls", [False, True])
def test_a_flood_of_silent_connections_costs_no_capture_and_no_change(root: Path, files: Files, tls) -> None:  # noqa: F811
    host = ADDRESS if tls else "127.0.0.1"
    options = ["--host", ADDRESS, "--cert", str(files.cert), "--key", str(files.key)] if tls else []
    words = ["serve", str(root), "--config", "simulated", "--port", "0", "--index", str(root / "index"), *options]
    with ExitStack() as stack:
        server = stack.enter_context(
            subprocess.Popen(
                [sys.executable, "-c", SERVE.format(limit=DESCRIPTORS), *words], stdout=subprocess.PIPE, text=True
            )
        )
        stack.callback(server.terminate)
        assert server.stdout is not None
        base, _, token = server.stdout.readline().strip().partition("/enter?token=")
        browser = stack.enter_context(
            httpx.Client(
                base_url=base, verify=files.pinned, trust_env=False, timeout=WAIT_S,
                headers={"Authorization": f"Bearer {token}"},
            )
        )  # fmt: skip
        wait_for(lambda: browser.get("/api/state").json()["scanner"]["connected"], "the scanner")
        assert browser.post("/api/sessions/missale/open").status_code == 200
        assert browser.post("/api/press", json={"action": "capture"}).status_code == 202
        flood = stack.enter_context(
            subprocess.Popen(
                [sys.executable, "-c", FLOOD.format(silent=SILENT, host=host, port=base.rpartition(":")[2])],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            )
        )  # fmt: skip
        stack.callback(flood.kill)
        notes: list[str] = []
        assert flood.stdout is not None
        for line in flood.stdout:
            note = f"at {line.strip()} connections"
            pages = browser.get("/api/pages").json()["pages"]
            if pages and browser.post("/api/press", json={"action": "note", "text": note}).status_code == 202:
                notes.append(note)
            if line.startswith("open"):
                break
        wait_for(lambda: browser.get("/api/pages").json()["pages"], "the page")
        label = {"leaf": "1", "label": "1r"}
        assert browser.put("/api/leaves", json=label, headers={"If-Match": '"0"'}).status_code == 200
        browser.post("/api/close")
    events = read_session(root / "missale").history.events
    stored = [event.facts.get("value") for event in events if event.name == "note"]
    assert stored == notes
    assert [event.name for event in events].count("capture") == 1
    assert verify(root / "missale").problems == ()
