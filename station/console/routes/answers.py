"""Common parts of the routes.

The application's state, the tab that sent a request, faults as answers.
"""

from __future__ import annotations

import logging
from typing import Annotated, Any, Literal

from fastapi import Depends, FastAPI, Header, Path, Query, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from starlette.exceptions import HTTPException

from station.console.faults import REPORTED, ConsoleFault, fault_of
from station.console.state.app_state import AppState
from station.console.state.control import PROGRAM, agent_of
from station.session.log.events import MAX_NUMBER, MAX_PAGE

IMMUTABLE = "private, max-age=31536000, immutable"
LOG = logging.getLogger("planish.console")
FAULTS: dict[int | str, dict[str, Any]] = {
    status: {"description": "a fault: `error` with key, text, hint and data"}
    for status in (400, 401, 403, 404, 405, 408, 409, 412, 413, 415, 422, 500, 503, 507)
}


def app_state_of(request: Request) -> AppState:
    """The state of the console that the application serves."""
    app_state: AppState = request.app.state.app_state
    return app_state


def acting(
    request: Request,
    tab: Annotated[str, Header(alias="X-Planish-Tab", pattern=r"^[A-Za-z0-9_-]{1,64}$")] = PROGRAM,
) -> AppState:
    """Return the application's state, for a request that changes something.

    Its tab is in control. Raises ConsoleFault.
    """
    app_state = app_state_of(request)
    if app_state.control.require(tab, agent_of(request.headers.get("user-agent", ""))):
        app_state.broadcast.changed()
    return app_state


Looking = Annotated[AppState, Depends(app_state_of)]
Acting = Annotated[AppState, Depends(acting)]
PageNumber = Annotated[int, Path(ge=1, le=MAX_PAGE)]
Prefix = Annotated[Literal["", "left.", "right."], Query(description="of the leaf, before the name of a layer")]
EventNumber = Annotated[int, Path(ge=1, le=MAX_NUMBER)]
Tag = Annotated[str, Header(alias="If-Match", pattern=r'^"(0|[1-9][0-9]{0,8})"$')]
"""The tag of what a change was made from."""


def number_of(tag: Tag) -> int:
    """Return the number in a tag."""
    return int(tag.strip('"'))


def tagged(response: Response, found: dict[str, Any]) -> dict[str, Any]:
    """Return an answer, with its tag as a header, too."""
    response.headers["ETag"] = f'"{found["tag"]}"'
    return found


def answer_faults(app: FastAPI) -> None:
    """Let every error end in the same form of answer."""

    def fault(_request: Request, error: Exception) -> Response:
        found = fault_of(error)
        return JSONResponse(found.body, found.status, found.headers)

    def not_valid(_request: Request, error: Exception) -> Response:
        assert isinstance(error, RequestValidationError)
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        found = ConsoleFault("invalid", f"{where}: {first['msg']}", "see /api/openapi.json", field=where)
        return JSONResponse(found.body, found.status)

    def no_route(_request: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)
        key = {404: "not_found", 405: "method"}.get(error.status_code, "invalid")
        found = ConsoleFault(key, str(error.detail), status=error.status_code)
        return JSONResponse(found.body, found.status, error.headers)

    def unexpected(request: Request, error: Exception) -> Response:
        LOG.error("%s %s", request.method, request.url.path, exc_info=error)
        return fault(request, error)

    for kind in (ConsoleFault, *REPORTED):
        app.add_exception_handler(kind, fault)
    app.add_exception_handler(RequestValidationError, not_valid)
    app.add_exception_handler(HTTPException, no_route)
    app.add_exception_handler(Exception, unexpected)
