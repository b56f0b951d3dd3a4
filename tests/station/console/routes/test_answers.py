"""Faults as answers: one form for all, and none that shows the program's inside."""

from __future__ import annotations

import asyncio

import httpx
from fastapi import FastAPI

from restore import BadInput
from station.console.faults import ConsoleFault
from station.console.routes.answers import answer_faults

app = FastAPI()
answer_faults(app)


@app.get("/busy")
def busy() -> None:
    raise ConsoleFault("streams_full", "full", "wait", headers={"Retry-After": "5"}, places=3)


@app.get("/bad")
def bad() -> None:
    raise BadInput("a.obj is damaged", "capture again")


@app.get("/bug")
def bug() -> None:
    raise ZeroDivisionError("secret")


@app.get("/count")
def count(number: int) -> int:
    return number


async def ask(*paths: str) -> list[httpx.Response]:
    """The answers to GETs; an empty path stands for a POST where GET is."""
    transport = httpx.ASGITransport(app, raise_app_exceptions=False)
    async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
        return [await (client.get(path) if path else client.post("/busy")) for path in paths]


def test_every_fault_has_the_same_form(caplog):
    full, wrong, count, gone, posted, fault = asyncio.run(ask("/busy", "/bad", "/count?number=x", "/gone", "", "/bug"))
    assert (full.status_code, full.headers["retry-after"]) == (503, "5")
    assert full.json() == {"error": {"key": "streams_full", "text": "full", "hint": "wait", "data": {"places": 3}}}
    assert wrong.json()["error"]["hint"] == "capture again"
    assert count.json()["error"]["data"] == {"field": "query.number"}
    assert gone.json()["error"]["key"] == "not_found"
    assert posted.json()["error"]["key"] == "method"
    assert (fault.status_code, fault.json()["error"]["key"]) == (500, "fault")
    assert "ZeroDivisionError" in caplog.text
