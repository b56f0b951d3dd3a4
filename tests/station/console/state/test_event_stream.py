"""Events: in order, with those that were missed, bounded."""

from __future__ import annotations

import asyncio
import json

import pytest

from station.console.faults import ConsoleFault
from station.console.state.event_stream import KEPT, MAX_BEHIND, EventStream

MANY = 10_000


def events_of(frame: bytes) -> list[tuple[str, str, object]]:
    """(id, name, data) of every event of some frames."""
    found = []
    for block in frame.decode().strip().split("\n\n"):
        fields = dict(line.split(": ", 1) for line in block.split("\n") if not line.startswith(":"))
        if "event" in fields:
            found.append((fields.get("id", ""), fields["event"], json.loads(fields["data"])))
    return found


async def taken(subscription) -> list[tuple[str, str, object]]:
    await asyncio.sleep(0)
    return events_of(await anext(subscription))


def test_events_come_in_order_with_their_numbers():
    async def run():
        stream = EventStream()
        stream.start()
        subscription = stream.subscribe()
        assert [name for _, name, _ in await taken(subscription)] == ["hello"]
        stream.publish("message", {"text": "ä\nb"})
        stream.publish("page", {"page": 1})
        first, second = await taken(subscription)
        assert first == (f"{stream.boot}-1", "message", {"text": "ä\nb"})
        assert second[0] == f"{stream.boot}-2"
        subscription.close()
        assert stream.count == 0

    asyncio.run(run())


def test_missed_events_are_sent_again_or_the_browser_is_asked_to_load_all():
    async def run():
        stream = EventStream()
        stream.start()
        for number in range(KEPT + 5):
            stream.publish("page", {"page": number})
        await asyncio.sleep(0)
        missed = await taken(stream.subscribe(f"{stream.boot}-{KEPT + 3}"))
        assert [data for _, name, data in missed if name == "page"] == [{"page": KEPT + 3}, {"page": KEPT + 4}]
        assert [name for _, name, _ in await taken(stream.subscribe(f"{stream.boot}-{KEPT + 5}"))] == ["hello"]
        for since in (
            f"{stream.boot}-1",
            "0-3",
            "nonsense",
            f"{stream.boot}-x",
            f"{stream.boot}-{KEPT + 6}",
            "-" * 40,
        ):
            assert [name for _, name, _ in await taken(stream.subscribe(since))] == ["hello", "reset"]

    asyncio.run(run())


def test_a_slow_stream_is_asked_to_load_all():
    async def run():
        stream = EventStream()
        stream.start()
        subscription = stream.subscribe()
        for number in range(3 * MAX_BEHIND):
            stream.publish("page", {"page": number})
        found = await taken(subscription)
        assert len(found) <= MAX_BEHIND + 1
        assert found[0][1] == "reset"
        assert found[-1][2] == {"page": 3 * MAX_BEHIND - 1}

    asyncio.run(run())


def test_an_idle_stream_has_a_beat():
    async def run():
        stream = EventStream(beat_s=0.01)
        stream.start()
        subscription = stream.subscribe()
        await anext(subscription)
        assert await anext(subscription) == b": beat\n\n"

    asyncio.run(run())


def test_ten_thousand_streams_are_refused_and_leave_nothing():
    async def run():
        stream = EventStream(max_streams=4)
        stream.start()
        streams = [stream.subscribe() for _ in range(4)]
        refused = 0
        for _ in range(MANY):
            with pytest.raises(ConsoleFault) as fault:
                stream.subscribe()
            refused += fault.value.key == "streams_full"
        assert (refused, stream.count) == (MANY, 4)
        assert fault.value.headers["Retry-After"]
        streams[0].close()
        stream.subscribe()

    asyncio.run(run())


def test_the_end_ends_every_stream():
    async def run():
        stream = EventStream()
        stream.start()
        subscription = stream.subscribe()
        await anext(subscription)
        stream.end()
        with pytest.raises(StopAsyncIteration):
            await anext(subscription)
        with pytest.raises(ConsoleFault, match="ending"):
            stream.subscribe()

    asyncio.run(run())


def test_events_before_the_loop_are_nobodys():
    EventStream().publish("state", {})
