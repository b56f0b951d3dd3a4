"""The application: the routes behind the guard."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager

from fastapi import FastAPI

from station.console import routes_jobs, routes_pages, routes_pictures, routes_settings, routes_station, routes_words
from station.console.answers import answer_faults
from station.console.desk import Desk
from station.console.files import PageFile, list_page
from station.console.guard import App, Door, Guard
from station.version import software_version


def build_app(desk: Desk, door: Door, files: Mapping[str, PageFile] | None = None) -> App:
    """The console as an ASGI application. files: those of the page; the shipped ones by default."""

    @asynccontextmanager
    async def life(_app: FastAPI) -> AsyncIterator[None]:
        await desk.start()
        try:
            yield
        finally:
            await desk.stop()

    app = FastAPI(
        title="Planish console",
        version=software_version(),
        openapi_url="/api/openapi.json",
        docs_url=None,
        redoc_url=None,
        lifespan=life,
        redirect_slashes=False,
    )
    app.state.desk, app.state.door = desk, door
    app.state.files = list_page() if files is None else files
    for routes in (routes_station, routes_pages, routes_pictures, routes_settings, routes_jobs, routes_words):
        app.include_router(routes.router)
    answer_faults(app)
    return Guard(app, door)
