"""Events: in order, with those that were missed, bounded."""

from __future__ import annotations

import asyncio
import json

import pytest

from station.console.faults import ConsoleFault
from station.console.state.event_stream import KEPT, MAX_BEHIND, Hub

MANY = 10_000


def events_of(frame: bytes) -> list[tuple[str, str, object]]:
    """(id, name, data) of every event of some frames."""
    found = []
    for block in frame.decode().strip().split("\n\n"):
        fields = dict(line.split(": ", 1) for line in block.split("\n") if not line.startswith(":"))
        if "event" in fields:
            found.append((fields.get("id", ""), fields["event"], json.loads(fields["data"])))
    return found


async def taken(stream) -> list[tuple[str, str, object]]:
    await asyncio.sleep(0)
    return events_of(await anext(stream))


def test_events_come_in_order_with_their_numbers():
    async def run():
        hub = Hub()
        hub.start()
        stream = hub.stream()
        assert [name for _, name, _ in await taken(stream)] == ["hello"]
        hub.publish("message", {"text": "ä\nb"})
        hub.publish("page", {"page": 1})
        first, second = await taken(stream)
        assert first == (f"{hub.boot}-1", "message", {"text": "ä\nb"})
        assert second[0] == f"{hub.boot}-2"
        stream.close()
        assert hub.count == 0

    asyncio.run(run())


def test_what_a_browser_missed_is_sent_again_or_it_is_told_to_load_all():
    async def run():
        hub = Hub()
        hub.start()
        for number in range(KEPT + 5):
            hub.publish("page", {"page": number})
        await asyncio.sleep(0)
        missed = await taken(hub.stream(f"{hub.boot}-{KEPT + 3}"))
        assert [data for _, name, data in missed if name == "page"] == [{"page": KEPT + 3}, {"page": KEPT + 4}]
        assert [name for _, name, _ in await taken(hub.stream(f"{hub.boot}-{KEPT + 5}"))] == ["hello"]
        for since in (f"{hub.boot}-1", "0-3", "nonsense", f"{hub.boot}-x", f"{hub.boot}-{KEPT + 6}", "-" * 40):
            assert [name for _, name, _ in await taken(hub.stream(since))] == ["hello", "reset"]

    asyncio.run(run())


def test_a_slow_stream_is_told_to_load_all():
    async def run():
        hub = Hub()
        hub.start()
        stream = hub.stream()
        for number in range(3 * MAX_BEHIND):
            hub.publish("page", {"page": number})
        found = await taken(stream)
        assert len(found) <= MAX_BEHIND + 1
        assert found[0][1] == "reset"
        assert found[-1][2] == {"page": 3 * MAX_BEHIND - 1}

    asyncio.run(run())


def test_an_idle_stream_has_a_beat():
    async def run():
        hub = Hub(beat_s=0.01)
        hub.start()
        stream = hub.stream()
        await anext(stream)
        assert await anext(stream) == b": beat\n\n"

    asyncio.run(run())


def test_ten_thousand_streams_are_refused_and_leave_nothing():
    async def run():
        hub = Hub(max_streams=4)
        hub.start()
        streams = [hub.stream() for _ in range(4)]
        refused = 0
        for _ in range(MANY):
            with pytest.raises(ConsoleFault) as fault:
                hub.stream()
            refused += fault.value.key == "streams_full"
        assert (refused, hub.count) == (MANY, 4)
        assert fault.value.headers["Retry-After"]
        streams[0].close()
        hub.stream()

    asyncio.run(run())


def test_the_end_ends_every_stream():
    async def run():
        hub = Hub()
        hub.start()
        stream = hub.stream()
        await anext(stream)
        hub.end()
        with pytest.raises(StopAsyncIteration):
            await anext(stream)
        with pytest.raises(ConsoleFault, match="ending"):
            hub.stream()

    asyncio.run(run())


def test_events_before_the_loop_are_nobodys():
    Hub().publish("state", {})
