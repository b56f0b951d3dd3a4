"""A simulated device behind a socket, for as long as a test needs it."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from drivers.simulated.device.device import SimulatedDevice
from drivers.simulated.serve import listen, serve


@contextmanager
def served(device: SimulatedDevice) -> Iterator[int]:
    """Serve a device; gives the port that it listens at."""
    with listen() as listener:
        thread = threading.Thread(target=serve, args=(device, listener))
        thread.start()
        try:
            yield listener.getsockname()[1]
        finally:
            listener.shutdown(socket.SHUT_RDWR)
            thread.join()
