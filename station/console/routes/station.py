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
from station.console.routes.requests import NewSession, OpenRequest, SessionName, TakeControl
from station.console.state import sessions
from station.console.state.control import agent_of
from station.console.state.event_stream import Subscription

router = APIRouter(responses=FAULTS)


class EventStreamResponse(StreamingResponse):
    """A stream of events, and what is done when it has ended, in whatever way."""

    def __init__(self, subscription: Subscription, ended: Callable[[], None]) -> None:
        super().__init__(subscription, media_type="text/event-stream")
        self._ended = ended

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send events until the client or the server goes."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._ended()


@router.get("/enter", include_in_schema=False)
def enter(request: Request, token: Annotated[str, Query(max_length=200)] = "") -> Response:
    """Open the page with the token of the printed link.

    The token is behind the `#`, which a browser sends to no server.
    """
    door: Door = request.app.state.door
    if not door.is_token(token):
        return HTMLResponse(ENTER_PAGE, 401)
    return RedirectResponse(f"/#token={token}&key={door.key}", 303, {"Cache-Control": "no-store"})


@router.get("/", include_in_schema=False)
def index(request: Request) -> Response:
    """The page."""
    return _page_file(request, INDEX)


@router.get("/page/{path:path}", include_in_schema=False)
def page_file(request: Request, path: str) -> Response:
    """A file of the page."""
    return _page_file(request, path)


@router.get("/api/state")
def state(app_state: Looking) -> dict[str, Any]:
    """The state of the station."""
    return app_state.state()


@router.get("/api/events", response_class=StreamingResponse, responses={200: {"content": {"text/event-stream": {}}}})
async def events(
    request: Request,
    app_state: Looking,
    tab: Annotated[str, Query(pattern=r"^[A-Za-z0-9_-]{16,64}$")] = "",
    since: Annotated[str, Query(max_length=40)] = "",
    last_event_id: Annotated[str, Header(max_length=40)] = "",
) -> StreamingResponse:
    """Events from now on, or from the last one that was received."""
    subscription = app_state.event_stream.subscribe(last_event_id or since)
    if tab and app_state.control.joined(tab, agent_of(request.headers.get("user-agent", ""))):
        app_state.broadcast.changed()

    def left() -> None:
        subscription.close()
        if tab:
            app_state.control.left(tab)

    return EventStreamResponse(subscription, left)


@router.post("/api/control")
def control(request: Request, app_state: Looking, wanted: TakeControl) -> dict[str, Any]:
    """Take control for a tab, or give it away."""
    if wanted.take:
        app_state.control.take(wanted.tab, agent_of(request.headers.get("user-agent", "")))
    else:
        app_state.control.release(wanted.tab)
    app_state.broadcast.changed()
    return app_state.state()


@router.get("/api/sessions")
def list_sessions(app_state: Looking) -> dict[str, Any]:
    """The sessions of the station's folder."""
    opened = None if app_state.open_session is None else app_state.open_session.name
    return {"root": str(app_state.root), "sessions": sessions.listed(app_state.root, opened)}


@router.post("/api/sessions", status_code=201)
def new_session(app_state: Acting, wanted: NewSession) -> dict[str, Any]:
    """Make a session."""
    return app_state.create(**wanted.model_dump())


@router.post("/api/sessions/{name}/open")
def open_session(app_state: Acting, name: SessionName, wanted: OpenRequest | None = None) -> dict[str, Any]:
    """Open a session."""
    app_state.open(name, read_only=wanted is not None and wanted.read_only)
    return app_state.state()


@router.post("/api/close")
def close_session(app_state: Acting) -> dict[str, Any]:
    """Close the open session."""
    app_state.close()
    return app_state.state()


@router.get("/api/presets")
def presets() -> dict[str, Any]:
    """Return the bundled presets."""
    return {"presets": sessions.presets()}


def _page_file(request: Request, name: str) -> Response:
    found: PageFile | None = request.app.state.files.get(name)
    if found is None:
        return Json({"error": {"key": "not_found", "text": "the file does not exist", "hint": "", "data": {}}}, 404)
    headers = {"ETag": f'"{found.tag}"', "Cache-Control": "no-cache"}
    if request.headers.get("if-none-match") == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    return FileResponse(found.path, media_type=found.media_type, headers=headers)
