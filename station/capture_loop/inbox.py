"""What the capture loop has to do next: a person is served before the machine."""

from __future__ import annotations

from queue import Empty, SimpleQueue
from threading import Semaphore
from typing import Generic, TypeVar

T = TypeVar("T")


class Inbox(Generic[T]):
    """Messages of a person, and results that wait until none of these is left.

    Its methods may be called from any thread.
    """

    def __init__(self) -> None:
        self._messages: SimpleQueue[T] = SimpleQueue()
        self._results: SimpleQueue[T] = SimpleQueue()
        self._count = Semaphore(0)

    def put(self, message: T) -> None:
        """Add what a person asks for: a key, a decision."""
        self._messages.put(message)
        self._count.release()

    def put_result(self, message: T) -> None:
        """Add what a computation gave."""
        self._results.put(message)
        self._count.release()

    def get(self) -> T:
        """Wait for a message, and return it.

        >>> inbox = Inbox[str]()
        >>> inbox.put_result("restored"), inbox.put("key")
        (None, None)
        >>> inbox.get(), inbox.get()
        ('key', 'restored')
        """
        self._count.acquire()
        try:
            return self._messages.get_nowait()
        except Empty:
            return self._results.get_nowait()

    def empty(self) -> bool:
        """Whether nothing is to be done."""
        return self._messages.empty() and self._results.empty()
