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
def jobs(desk: Looking) -> dict[str, Any]:
    """The jobs of this start, the newest first."""
    return {"jobs": [job.as_json() for job in desk.jobs.all()]}


@router.get("/jobs/{number}")
def job(desk: Looking, number: JobNumber) -> dict[str, Any]:
    """A job."""
    return desk.jobs.find(number).as_json()


@router.post("/jobs/{number}/cancel", status_code=202)
def cancel(desk: Acting, number: JobNumber) -> dict[str, Any]:
    """End a job."""
    return desk.jobs.cancel(number).as_json()


@router.get("/jobs/{number}/files")
def files(desk: Looking, number: JobNumber) -> dict[str, Any]:
    """The files that a job has written."""
    found = files_of(desk.jobs.find(number))
    return {"files": [{"n": n, "name": name, "bytes": path.stat().st_size} for n, (name, path) in enumerate(found)]}


@router.get("/jobs/{number}/files/{place}", response_class=FileResponse)
def file(desk: Looking, number: JobNumber, place: Annotated[int, Path(ge=0, le=10_000_000)]) -> FileResponse:
    """One of them, by its number in the list."""
    found = files_of(desk.jobs.find(number))
    if place >= len(found):
        raise ConsoleFault("not_found", f"job {number} has {len(found)} files")
    name, path = found[place]
    return FileResponse(path, filename=name.rpartition("/")[2], media_type="application/octet-stream")


@router.post("/export", status_code=202)
def export(desk: Acting, wanted: Export) -> dict[str, Any]:
    """Write a session to a new folder in a format of archives and libraries, and check it."""
    return desk.begin(export_task(desk.root, desk.folder_of(wanted.session), wanted.format, wanted.url)).as_json()


@router.post("/batch", status_code=202)
def batch(desk: Acting, wanted: Batch) -> dict[str, Any]:
    """Restore all pages of sessions that are not restored."""
    return desk.begin(batch_task(desk.root, desk.held, wanted.sessions, wanted.workers, desk.now)).as_json()


@router.post("/sessions/{name}/verify", status_code=202)
def verify(desk: Acting, name: SessionName) -> dict[str, Any]:
    """Compare every file of a session with what its events say."""
    return desk.begin(verify_task(desk.root, desk.held, name)).as_json()
