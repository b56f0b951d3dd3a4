"""What browsers are sent: states that are not too many, rows that differ; new folders for jobs."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime
from types import SimpleNamespace

from station.capture_loop.loop import Message
from station.console.state.broadcast import Broadcast
from station.console.state.event_stream import EventStream
from station.console.state.shown import captures_left, stamp
from station.storage.disk import free_folder
from tests.station.console.state.test_event_stream import events_of


def sent(work) -> list[tuple[str, object]]:
    """The events that a piece of work sends."""

    async def run():
        event_stream = EventStream()
        broadcast = Broadcast(event_stream, lambda: {"n": 1})
        broadcast.start()
        subscription = event_stream.subscribe()
        await anext(subscription)
        work(broadcast)
        await asyncio.sleep(0.15)
        event_stream.publish("end", {})
        await asyncio.sleep(0)
        return [(name, data) for _, name, data in events_of(await anext(subscription)) if name != "end"]

    return asyncio.run(run())


def test_many_changes_are_one_state():
    def work(broadcast):
        for _ in range(50):
            broadcast.changed()

    assert sent(work) == [("state", {"n": 1})]


def test_rows_are_sent_when_they_differ_and_all_of_them_when_their_order_does():
    def row(page, **values):
        return {"page": page, **values}

    def work(broadcast):
        broadcast.rows([row(1), row(2)])
        broadcast.rows([row(1), row(2, level="green"), row(3)])
        broadcast.rows([row(1), row(3), row(2)])

    names = [(name, data.get("page", {}).get("page")) for name, data in sent(work) if name != "state"]
    assert names == [("page", 1), ("page", 2), ("page", 2), ("page", 3), ("pages", None)]


def test_a_line_keeps_its_key_and_its_page():
    (line, *_) = sent(lambda broadcast: broadcast.line(Message("page 3: stored", "stored", 3)))
    assert line == ("message", {"text": "page 3: stored", "key": "stored", "page": 3, "data": {}})


def test_after_the_end_nothing_is_sent():
    async def run():
        broadcast = Broadcast(EventStream(), dict)
        broadcast.start()
        broadcast.stop()
        broadcast.changed()
        broadcast.all_changed()

    asyncio.run(run())


def test_free_space_is_shown_in_pages():
    opened = SimpleNamespace(page_sizes=lambda: [10, 30])
    assert captures_left(opened, 100) == 5
    assert captures_left(SimpleNamespace(page_sizes=list), 100) is None
    assert stamp(datetime(2026, 1, 2, 3, 4, 5, 678_901, UTC)) == "2026-01-02T03:04:05.678Z"


def test_a_new_folder_takes_the_first_free_name(tmp_path):
    assert free_folder(tmp_path / "a").name == "a"
    (tmp_path / "a").symlink_to("nowhere")
    (tmp_path / "a-2").mkdir()
    assert free_folder(tmp_path / "a").name == "a-3"
