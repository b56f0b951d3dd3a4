"""Connections are counted from the moment they are accepted; no socket is left when one is given up."""

from __future__ import annotations

import asyncio
import socket

from station.console.http.connections import Connections
from station.console.http.protocol import ConsoleProtocol, Phase


class Quiet(asyncio.Protocol):
    """A connection that says nothing, and of which nothing is wanted."""

    head_s, transport = 5.0, None
    on_phase = staticmethod(lambda _connection, _phase: None)

    def connection_made(self, transport) -> None:
        self.transport = transport

    def connection_lost(self, exc) -> None:
        self.on_phase(self, None)


def test_the_longest_silent_one_makes_room_and_busy_ones_do_not():
    async def run() -> None:
        made: list[Quiet] = []

        def make() -> ConsoleProtocol:
            made.append(Quiet())
            return made[-1]  # type: ignore[return-value]

        connections = Connections(make, 3)
        with socket.socket() as listener:
            listener.bind(("127.0.0.1", 0))
            listener.listen()
            listener.setblocking(False)
            accepting = asyncio.create_task(connections.accept(listener))
            lines = []
            for number in range(5):
                lines.append(socket.create_connection(listener.getsockname()))
                while len(made) <= number or made[number].transport is None:
                    await asyncio.sleep(0.01)
                if number == 0:
                    made[0].on_phase(made[0], Phase.BUSY)
            await asyncio.sleep(0.05)
            assert connections.count == 3
            assert [one.transport.is_closing() for one in made] == [False, True, True, False, False]
            lasting = [one.transport.get_extra_info("socket") for one in (made[0], made[3], made[4])]
            assert all(one.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) for one in lasting)  # else 40 ms more
            for one in made:
                one.on_phase(one, Phase.BUSY)
            lines.append(socket.create_connection(listener.getsockname()))
            lines[-1].setblocking(False)
            assert await asyncio.wait_for(asyncio.get_running_loop().sock_recv(lines[-1], 1), 5.0) == b""
            assert len(made) == 5  # none of them is silent: the new one is refused
            accepting.cancel()
            connections.end()
            for one in made:
                one.transport.abort()
            await asyncio.sleep(0.05)
            for line in lines:
                line.close()

    asyncio.run(run())
