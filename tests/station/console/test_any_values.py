"""No value of any parameter is a fault of the server: schemathesis asks every route what OpenAPI allows and not.

`python -m bench.console` asks many more.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from schemathesis import GenerationMode

from station.console.app import build_app
from station.console.http.guard import Door
from station.console.state.app_state import AppState
from tests.station.conftest import curl_scan
from tests.station.console.conftest import GatedScanner, Served, StandInRestorer, serving

EXAMPLES = 4  # for each route and each mode
ENDLESS = {"/api/events"}
SERVER_ERRORS = range(500, 600)


@pytest.fixture
def asked(root) -> Iterator[Served]:
    """A console with a page in its open session."""
    with serving(root, GatedScanner(curl_scan()), StandInRestorer()) as served, served.client() as browser:
        browser.post("/api/sessions/missale/open")
        browser.post("/api/press", json={"action": "capture"})
        yield served


def described(tmp_path) -> dict:
    app_state = AppState(tmp_path, None)
    guard = build_app(app_state, Door(frozenset(), "http", "t"), {})
    app_state.end()
    return guard.inner.openapi()


@pytest.mark.slow
def test_no_value_is_a_fault_of_the_server(asked, tmp_path):
    schema = schemathesis.openapi.from_dict(described(tmp_path))
    answers: dict[str, list[int]] = {}
    limits = settings(
        max_examples=EXAMPLES,
        database=None,
        derandomize=True,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    for result in schema.get_all_operations():
        operation = result.ok()
        if operation.path in ENDLESS:
            continue
        seen = answers.setdefault(operation.label, [])
        for mode in (GenerationMode.POSITIVE, GenerationMode.NEGATIVE):
            if mode is GenerationMode.NEGATIVE and not takes_values(operation):
                continue

            ask_all(operation.as_strategy(generation_mode=mode), limits, asked, seen)
    faults = {label: seen for label, seen in answers.items() if set(seen) & set(SERVER_ERRORS)}
    assert faults == {}
    assert all(answers.values())
    assert {200, 404, 422} <= {status for seen in answers.values() for status in seen}


def ask_all(cases, limits: settings, served: Served, seen: list[int]) -> None:
    """Send every case to the console, and note the status of its answer."""

    @limits
    @given(case=cases)
    def ask(case):
        headers = {"Authorization": f"Bearer {served.token}"}
        seen.append(case.call(base_url=served.origin, headers=headers).status_code)

    ask()


def takes_values(operation) -> bool:
    """Whether an operation has a parameter or a body that could be of a wrong type."""
    return any(True for _ in operation.iter_parameters()) or bool(operation.body)
