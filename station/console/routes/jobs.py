"""Routes of jobs: batch, export, the check of a session; their files."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path
from fastapi.responses import FileResponse

from station.console.faults import ConsoleFault
from station.console.routes.answers import FAULTS, Acting, Looking
from station.console.routes.requests import Batch, Export, SessionName
from station.console.state.jobs import files_of
from station.console.state.tasks import batch_task, export_task, verify_task

router = APIRouter(prefix="/api", responses=FAULTS)
JobNumber = Annotated[str, Path(pattern=r"^[1-9][0-9]{0,8}$")]


@router.get("/jobs")
def jobs(app_state: Looking) -> dict[str, Any]:
    """The jobs of this start, the newest first."""
    return {"jobs": [job.as_json() for job in app_state.jobs.all()]}


@router.get("/jobs/{number}")
def job(app_state: Looking, number: JobNumber) -> dict[str, Any]:
    """A job."""
    return app_state.jobs.find(number).as_json()


@router.post("/jobs/{number}/cancel", status_code=202)
def cancel(app_state: Acting, number: JobNumber) -> dict[str, Any]:
    """End a job."""
    return app_state.jobs.cancel(number).as_json()


@router.get("/jobs/{number}/files")
def files(app_state: Looking, number: JobNumber) -> dict[str, Any]:
    """The files that a job has written."""
    found = files_of(app_state.jobs.find(number))
    return {"files": [{"n": n, "name": name, "bytes": path.stat().st_size} for n, (name, path) in enumerate(found)]}


@router.get("/jobs/{number}/files/{place}", response_class=FileResponse)
def file(app_state: Looking, number: JobNumber, place: Annotated[int, Path(ge=0, le=10_000_000)]) -> FileResponse:
    """One of them, by its number in the list."""
    found = files_of(app_state.jobs.find(number))
    if place >= len(found):
        raise ConsoleFault("not_found", f"job {number} has {len(found)} files")
    name, path = found[place]
    return FileResponse(path, filename=name.rpartition("/")[2], media_type="application/octet-stream")


@router.post("/export", status_code=202)
def export(app_state: Acting, wanted: Export) -> dict[str, Any]:
    """Write a session to a new folder in an archive format, and check it."""
    return app_state.begin(
        export_task(app_state.root, app_state.folder_of(wanted.session), wanted.format, wanted.url)
    ).as_json()


@router.post("/batch", status_code=202)
def batch(app_state: Acting, wanted: Batch) -> dict[str, Any]:
    """Restore all pages of sessions that are not restored."""
    return app_state.begin(
        batch_task(app_state.root, app_state.held, wanted.sessions, wanted.workers, app_state.now)
    ).as_json()


@router.post("/sessions/{name}/verify", status_code=202)
def verify(app_state: Acting, name: SessionName) -> dict[str, Any]:
    """Compare every file of a session with what its events say."""
    return app_state.begin(verify_task(app_state.root, app_state.held, name)).as_json()
