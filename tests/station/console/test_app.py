"""The whole interface, as OpenAPI describes it."""

from __future__ import annotations

from typing import get_args

from station.console.app import build_app
from station.console.http.guard import Door, Guard
from station.console.routes import about, corrections, jobs, leaves, pages, pictures, settings, station, words
from station.console.routes.requests import Action
from station.console.state.actions import DO, ON_A_PAGE, SHOTS
from station.console.state.app_state import AppState

ROUTES = (about, corrections, jobs, leaves, pages, pictures, settings, station, words)


def test_every_action_is_done_and_known():
    actions = set(get_args(Action))
    assert actions == set(DO) | {"preview"}
    assert actions > ON_A_PAGE | SHOTS


def test_every_route_of_the_interface_is_described(client):
    described = client.get("/api/openapi.json").json()["paths"]
    routes = [route for module in ROUTES for route in module.router.routes]
    paths = {route.path for route in routes if route.include_in_schema}
    assert paths == set(described)
    assert all(operation["description"] for path in described.values() for operation in path.values())


def test_the_guard_stands_before_the_application(tmp_path):
    app_state = AppState(tmp_path, None)
    assert isinstance(build_app(app_state, Door(frozenset(), "http", "t"), {}), Guard)
    app_state.end()
