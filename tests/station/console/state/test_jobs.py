"""Jobs: an export and its check, a batch, the check of a session; ended by hand and by the end of the server."""

from __future__ import annotations

import hashlib
import json
import sys
from datetime import UTC, datetime
from pathlib import Path

import psutil
import pytest

from station.batch.progress import Done, Event
from station.batch.runner import Finished
from station.console import work
from station.console.faults import ConsoleFault
from station.console.state.jobs import MAX_WAITING, Job, Jobs
from station.session import add_files, open_session
from tests.station.conftest import curl_scan
from tests.station.console.conftest import GatedScanner, StandInRestorer, serving, wait_for

SLEEPER = (sys.executable, "-c", 'import time; print(\'{"progress": ["asleep", 0.5]}\', flush=True); time.sleep(600)')


def ended(browser, number: str) -> dict:
    def state():
        job = browser.get(f"/api/jobs/{number}").json()
        return job if job["state"] not in ("waiting", "running") else None

    return wait_for(state, "the job", within=400.0)


@pytest.fixture
def filled(root: Path) -> Path:
    """The session with one page: a scan file by others, not restored."""
    (root / "scan.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with open_session(root / "missale") as writer:
        add_files(writer, {"scan.obj": root / "scan.obj"}, "scan.obj", facts={"by": "a test"})
    return root


@pytest.mark.slow
def test_an_export_is_written_checked_and_downloaded(filled, served, client):
    client.post("/api/sessions/missale/open", json={"read_only": True})
    begun = client.post("/api/export", json={"format": "bagit"})
    assert begun.status_code == 202
    job = ended(client, begun.json()["id"])
    assert (job["state"], job["result"]["valid"], job["result"]["problems"]) == ("done", True, [])
    assert any("restored" in line or "page" in line for line in job["result"]["missing"])
    files = client.get(job["result"]["download"]).json()["files"]
    assert len(files) == job["result"]["files"]
    assert sum(file["bytes"] for file in files) == job["result"]["bytes"]
    scan = next(file for file in files if file["name"].endswith("scan.obj"))
    answer = client.get(f"/api/jobs/{job['id']}/files/{scan['n']}")
    assert hashlib.sha512(answer.content).digest() == hashlib.sha512((filled / "scan.obj").read_bytes()).digest()
    assert "attachment" in answer.headers["content-disposition"]
    assert client.get(f"/api/jobs/{job['id']}/files/9999").status_code == 404
    secret = Path(job["result"]["folder"]) / "link"
    secret.symlink_to("/etc/passwd")
    assert len(client.get(job["result"]["download"]).json()["files"]) == len(files)
    again = [client.post("/api/export", json={"session": "missale", "format": "bagit"}).json() for _ in range(2)]
    folders = [Path(ended(client, job["id"])["result"]["folder"]).name for job in again]  # both were queued at once
    assert folders == ["missale-bagit-2", "missale-bagit-3"]


def test_what_cannot_be_exported_says_why(served, client):
    begun = client.post("/api/export", json={"session": "missale", "format": "pdf"}).json()
    job = ended(client, begun["id"])
    assert job["state"] == "failed"
    assert "nothing to export" in job["error"]["text"]
    assert client.post("/api/export", json={"format": "pdf"}).json()["error"]["key"] == "no_session_open"
    assert client.post("/api/export", json={"session": "x", "format": "pdf"}).json()["error"]["key"] == "no_session"
    assert client.get(f"/api/jobs/{begun['id']}/files").status_code == 404
    assert client.get("/api/jobs/77").status_code == 404


@pytest.mark.slow
def test_a_session_is_checked_and_a_changed_file_is_named(filled, served, client):
    assert ended(client, client.post("/api/sessions/missale/verify").json()["id"])["result"]["problems"] == []
    stored = next((filled / "missale").rglob("scan.obj"))
    stored.chmod(0o600)
    stored.write_text("changed")
    (problem,) = ended(client, client.post("/api/sessions/missale/verify").json()["id"])["result"]["problems"]
    assert (problem["page"], problem["kind"]) == (1, "damaged")
    client.post("/api/sessions/missale/open")
    assert client.post("/api/sessions/missale/verify").json()["error"]["key"] == "session_open"
    assert client.post("/api/batch", json={"sessions": ["missale"]}).json()["error"]["key"] == "session_open"


@pytest.mark.slow
def test_a_batch_sets_a_page_aside_and_lists_it(filled, served, client):
    begun = client.post("/api/batch", json={"sessions": ["missale"], "workers": 1}).json()
    job = ended(client, begun["id"])
    assert job["state"] == "done", job
    assert [item["state"] for item in job["items"]] == ["set aside"]
    assert job["result"]["set_aside"] == 1
    names = [file["name"] for file in client.get(job["result"]["download"]).json()["files"]]
    assert "report.html" in names


def processes() -> set[int]:
    return {child.pid for child in psutil.Process().children(recursive=True)}


def test_jobs_wait_for_their_turn_and_are_cancelled(root):
    with serving(root, GatedScanner(curl_scan()), StandInRestorer(), job_command=SLEEPER) as served:
        before = processes()
        with served.client() as browser:
            one, two = (browser.post("/api/sessions/missale/verify").json()["id"] for _ in range(2))
            running = wait_for(lambda: (job := browser.get(f"/api/jobs/{one}").json())["stage"] and job)
            assert (running["state"], running["stage"], running["done"]) == ("running", "asleep", 0.5)
            assert browser.get(f"/api/jobs/{two}").json()["state"] == "waiting"
            assert [job["id"] for job in browser.get("/api/state").json()["jobs"]] == [two, one]
            assert browser.post(f"/api/jobs/{one}/cancel").status_code == 202
            assert ended(browser, one)["state"] == "cancelled"
            wait_for(lambda: browser.get(f"/api/jobs/{two}").json()["state"] == "running")
            for _ in range(MAX_WAITING):
                browser.post("/api/sessions/missale/verify")
            assert browser.post("/api/sessions/missale/verify").json()["error"]["key"] == "busy"
    assert processes() - before == set()  # the end of the server ended them


def test_a_process_that_dies_is_a_failed_job(root):
    scanner, restorer = GatedScanner(curl_scan()), StandInRestorer()
    with serving(root, scanner, restorer, job_command=("false",)) as served, served.client() as browser:
        job = ended(browser, browser.post("/api/sessions/missale/verify").json()["id"])
    assert (job["state"], job["error"]["text"]) == ("failed", "the process of this job has ended")


def test_nonsense_of_a_process_changes_nothing():
    job = Job("1", "export", {}, {})
    before = json.dumps(job.as_json())
    for message in (
        {},
        {"progress": "x"},
        {"progress": [1, 2]},
        {"item": 3},
        {"result": []},
        {"error": None},
        {"x": 1},
    ):
        job.hear(message)
    assert json.dumps(job.as_json()) == before


def test_before_its_loop_starts_it_has_no_jobs():
    with pytest.raises(ConsoleFault, match="ending"):
        Jobs(lambda _job: None, lambda: datetime.now(UTC)).begin("verify", {}, {})


def test_a_fault_of_the_work_is_reported(root):
    reported = []
    work.run({"kind": "verify", "session": str(root / "gone")}, reported.append)
    work.run({"kind": "magic"}, reported.append)
    assert "is not a session" in reported[0]["error"]["text"]
    assert "magic" in reported[1]["error"]["text"]


def test_a_batch_reports_each_page_and_how_far_it_is(root, monkeypatch):
    def run_batch(_sessions, out, _options, _workers, show):
        show(Event("restored", "Missale, page 2", "green", Done(3, 12, datetime.now(UTC))))
        return Finished(out / "report.html", ())

    monkeypatch.setattr(work, "run_batch", run_batch)
    reported = []
    work.run({"kind": "batch", "sessions": [], "out": str(root)}, reported.append)
    item = {"name": "Missale, page 2", "state": "restored", "text": "green"}
    assert reported[:2] == [{"item": item}, {"progress": ["3 of 12", 0.25]}]
    assert reported[2]["result"]["restored"] == 1
