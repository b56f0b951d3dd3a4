"""Routes of the station: entry, the page's files, state, events, control, sessions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, Header, Query, Request
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse, Response, StreamingResponse
from fastapi.responses import JSONResponse as Json
from starlette.types import Receive, Scope, Send

from station.console.http.files import INDEX, PageFile
from station.console.http.guard import ENTER_PAGE, Door
from station.console.routes.answers import FAULTS, Acting, Looking
from station.console.routes.requests import NewSession, OpenSession, SessionName, TakeControl
from station.console.state import sessions
from station.console.state.control import agent_of
from station.console.state.event_stream import Stream

router = APIRouter(responses=FAULTS)


class EventStream(StreamingResponse):
    """A stream of events, and what is done when it has ended, in whatever way."""

    def __init__(self, stream: Stream, ended: Callable[[], None]) -> None:
        super().__init__(stream, media_type="text/event-stream")
        self._ended = ended

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send events until the client or the server goes."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._ended()


COOKIE_S = 30 * 24 * 3600  # a station runs for weeks; the token is that of its start


@router.get("/enter", include_in_schema=False)
def enter(request: Request, token: Annotated[str, Query(max_length=200)] = "") -> Response:
    """Exchange the token of the printed link for a cookie that no script can read."""
    door: Door = request.app.state.door
    if not door.is_token(token):
        return HTMLResponse(ENTER_PAGE, 401)
    answer = RedirectResponse("/", 303)
    answer.set_cookie(
        door.cookie, token, max_age=COOKIE_S, httponly=True, samesite="strict", secure=door.scheme == "https", path="/"
    )
    return answer


@router.get("/", include_in_schema=False)
def index(request: Request) -> Response:
    """The page."""
    return _page_file(request, INDEX)


@router.get("/page/{path:path}", include_in_schema=False)
def page_file(request: Request, path: str) -> Response:
    """A file of the page."""
    return _page_file(request, path)


@router.get("/api/state")
def state(desk: Looking) -> dict[str, Any]:
    """The state of the station."""
    return desk.state()


@router.get("/api/events", response_class=StreamingResponse, responses={200: {"content": {"text/event-stream": {}}}})
async def events(
    request: Request,
    desk: Looking,
    tab: Annotated[str, Query(pattern=r"^[A-Za-z0-9_-]{16,64}$")] = "",
    since: Annotated[str, Query(max_length=40)] = "",
    last_event_id: Annotated[str, Header(max_length=40)] = "",
) -> StreamingResponse:
    """Events from now on, or from the last one that was received."""
    stream = desk.hub.stream(last_event_id or since)
    if tab and desk.control.joined(tab, agent_of(request.headers.get("user-agent", ""))):
        desk.told.changed()

    def left() -> None:
        stream.close()
        if tab:
            desk.control.left(tab)

    return EventStream(stream, left)


@router.post("/api/control")
def control(request: Request, desk: Looking, wanted: TakeControl) -> dict[str, Any]:
    """Take control for a tab, or give it away."""
    if wanted.take:
        desk.control.take(wanted.tab, agent_of(request.headers.get("user-agent", "")))
    else:
        desk.control.release(wanted.tab)
    desk.told.changed()
    return desk.state()


@router.get("/api/sessions")
def list_sessions(desk: Looking) -> dict[str, Any]:
    """The sessions of the station's folder."""
    opened = None if desk.sitting is None else desk.sitting.name
    return {"root": str(desk.root), "sessions": sessions.listed(desk.root, opened)}


@router.post("/api/sessions", status_code=201)
def new_session(desk: Acting, wanted: NewSession) -> dict[str, Any]:
    """Make a session."""
    return desk.create(**wanted.model_dump())


@router.post("/api/sessions/{name}/open")
def open_session(desk: Acting, name: SessionName, wanted: OpenSession | None = None) -> dict[str, Any]:
    """Open a session."""
    desk.open(name, read_only=wanted is not None and wanted.read_only)
    return desk.state()


@router.post("/api/close")
def close_session(desk: Acting) -> dict[str, Any]:
    """Close the open session."""
    desk.close()
    return desk.state()


@router.get("/api/presets")
def presets() -> dict[str, Any]:
    """The presets that come along."""
    return {"presets": sessions.presets()}


def _page_file(request: Request, name: str) -> Response:
    found: PageFile | None = request.app.state.files.get(name)
    if found is None:
        return Json({"error": {"key": "not_found", "text": "there is no such file", "hint": "", "data": {}}}, 404)
    headers = {"ETag": f'"{found.tag}"', "Cache-Control": "no-cache"}
    if request.headers.get("if-none-match") == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    return FileResponse(found.path, media_type=found.media_type, headers=headers)
