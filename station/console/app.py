"""The application: the routes behind the guard."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager

from fastapi import FastAPI

from station.console.http.files import PageFile, list_page
from station.console.http.guard import App, Door, Guard
from station.console.routes import about, corrections, jobs, leaves, pages, pictures, settings, station, words
from station.console.routes.answers import answer_faults
from station.console.state.app_state import AppState
from station.version import software_version


def build_app(app_state: AppState, door: Door, files: Mapping[str, PageFile] | None = None) -> App:
    """Return the web interface as an ASGI application.

    files: those of the page; the shipped ones by default.
    """

    @asynccontextmanager
    async def life(_app: FastAPI) -> AsyncIterator[None]:
        await app_state.start()
        try:
            yield
        finally:
            await app_state.stop()

    app = FastAPI(
        title="Planish console",
        version=software_version(),
        openapi_url="/api/openapi.json",
        docs_url=None,
        redoc_url=None,
        lifespan=life,
        redirect_slashes=False,
    )
    app.state.app_state, app.state.door = app_state, door
    app.state.files = list_page() if files is None else files
    for routes in (station, pages, corrections, leaves, about, pictures, settings, jobs, words):
        app.include_router(routes.router)
    answer_faults(app)
    return Guard(app, door)
