"""`planish serve` as it is typed: the link, who may listen where, and an end that leaves the laser off."""

from __future__ import annotations

import builtins
import os
import signal
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from station.cli import main
from station.commands.serve import print_code
from station.console.serving import Address, bind, check_address, door_of, link_of, max_connections
from station.errors import UsageError
from tests.station.conftest import curl_scan
from tests.station.console.conftest import WAIT_S, GatedScanner, StandInRestorer, serving, wait_for

HERE = Path(__file__)


def test_the_link_opens_the_console_and_a_signal_ends_it(root):
    command = [sys.executable, "-m", "station", "serve", str(root), "--port", "0", "--index", str(root / "i.sqlite")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        link = process.stdout.readline().strip()
        with httpx.Client(trust_env=False, timeout=WAIT_S) as browser:
            entered = browser.get(link)
            assert entered.status_code == 303
            base, _, token = link.partition("/enter?token=")
            assert browser.get(f"{base}/api/state").status_code == 401  # a cookie would be sent to other ports, too
            browser.headers["Authorization"] = f"Bearer {token}"
            assert browser.get(f"{base}/api/state").json()["scanner"]["configured"] is False
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=WAIT_S)
    assert process.returncode == 128 + signal.SIGTERM
    assert "stopped by SIGTERM" in errors


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--host", "192.0.2.1"], "others can read along"),
        (["--host", "192.0.2.1", "--cert", "a"], "--cert and --key go together"),
        (["--qr"], "--qr shows the link to other devices"),
        (["--config", "gone.toml"], "the configuration 'gone.toml' does not exist"),
    ],
)
def test_what_cannot_be_served_is_refused_before_any_work(root, capsys, options, text):
    assert main(["serve", str(root), *options]) == 2
    assert text in capsys.readouterr().err


@pytest.mark.parametrize("host", ["0.0.0.0", "0", "", "0x0", "0.0", "::", "::ffff:0.0.0.0"])
def test_every_invalid_address_is_refused_however_it_is_written(host):
    address = Address(host, 0, Path("a"), Path("b"))
    check_address(address)
    with pytest.raises(UsageError, match="that is every address"):
        bind(address)


def test_a_folder_that_is_not_there(tmp_path, capsys):
    assert main(["serve", str(tmp_path / "gone")]) == 2
    assert "is not a folder" in capsys.readouterr().err


def test_without_its_packages_the_command_names_what_to_install(root, capsys, monkeypatch):
    whole = builtins.__import__

    def without(name, *arguments, **options):
        if name.startswith("station.console.state.app_state"):
            raise ModuleNotFoundError("no module", name="fastapi")
        return whole(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    assert main(["serve", str(root)]) == 2
    errors = capsys.readouterr().err
    assert "the console needs fastapi" in errors
    assert "planish[console]" in errors


def test_a_port_that_is_taken_is_named():
    with bind(Address(port=0)) as listener:
        listener.listen()
        with pytest.raises(UsageError, match="cannot listen on") as refused:
            bind(Address(port=listener.getsockname()[1]))
    assert "--port" in refused.value.hint


def test_only_its_own_names_open_the_door():
    door = door_of(Address(), 8765, "t")
    assert door.hosts == {"127.0.0.1:8765", "localhost:8765"}
    tls = Address("Station.example", 443, Path("c"), Path("k"))
    check_address(tls)
    assert door_of(tls, 443, "t").hosts == {"station.example:443", "station.example"}
    assert door_of(tls, 443, "t").origins == {"https://station.example:443", "https://station.example"}
    assert link_of(Address("::1"), 8765, door) == "http://[::1]:8765/enter?token=t"
    assert door_of(Address(), 1).token != door_of(Address(), 1).token


def test_the_page_is_served_from_its_list_alone(root, tmp_path):
    page = tmp_path / "page"
    page.mkdir()
    (page / "index.html").write_text("<!doctype html><title>t</title>")
    (page / "app.js").write_text("export {}")
    (page / "secret.key").write_text("no")
    (page / "link.js").symlink_to(HERE)
    with serving(root, GatedScanner(curl_scan()), StandInRestorer(), page=page) as served, served.client() as browser:
        index = browser.get("/")
        assert (index.status_code, index.headers["content-type"]) == (200, "text/html; charset=utf-8")
        script = browser.get("/page/app.js")
        assert script.headers["content-type"] == "text/javascript; charset=utf-8"
        again = browser.get("/page/app.js", headers={"If-None-Match": script.headers["etag"]})
        assert (again.status_code, again.content) == (304, b"")
        for name in ("secret.key", "link.js", "gone.js", "index.html/"):
            assert browser.get(f"/page/{name}").status_code == 404


@pytest.mark.slow
def test_a_killed_server_leaves_a_session_that_opens_whole(root, tmp_path):
    """kill -9 beside a shift: the lock goes with the process."""
    command = [sys.executable, "-m", "station", "serve", str(root), "--port", "0", "--index", str(tmp_path / "i")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        link = process.stdout.readline().strip()
        base, _, token = link.partition("/enter?token=")
        with httpx.Client(trust_env=False, timeout=WAIT_S, headers={"Authorization": f"Bearer {token}"}) as browser:
            assert browser.post(f"{base}/api/sessions/missale/open").status_code == 200
            assert main(["session", "recover", str(root / "missale"), "--index", str(tmp_path / "i")]) == 2
        os.kill(process.pid, signal.SIGKILL)
    wait_for(lambda: main(["session", "recover", str(root / "missale"), "--index", str(tmp_path / "i")]) == 0)


def test_the_link_is_shown_as_a_code_for_tablets(capsys):
    print_code("https://station.example:8765/enter?token=x")
    printed = capsys.readouterr().out
    assert len(printed.splitlines()) > 15
    assert set(printed) & set("█▀▄")


def test_there_are_as_many_connections_as_descriptors_allow(monkeypatch):
    for allowed, connections in ((1024, 824), (20_000, 4000), (-1, 4000), (256, 200)):
        limits = (allowed, allowed)
        monkeypatch.setattr("station.console.serving.resource.getrlimit", lambda _what, limits=limits: limits)
        assert max_connections() == connections
