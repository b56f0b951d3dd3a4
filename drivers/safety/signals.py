"""Ending signals (Ctrl-C, SIGTERM, SIGHUP) held back while parking."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self

ENDING_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
SIGNAL_BASE = 128  # a shell reports a process that signal n has ended as 128 + n


class SignalGuard:
    """Let the first ending signal interrupt the block; hold back later ones.

    After `hold` no signal interrupts, and none cuts a system call short. A signal that was held back is delivered at
    the end of the block, unless the block ends by an error or a signal: then the work is ending already. Handlers of
    the surrounding program are called and restored; a signal that it ignores stays ignored. Python runs handlers in the
    main thread only: in other threads the guard does nothing.
    """

    def __init__(self) -> None:
        self._previous: dict[int, Any] = {}
        self._held: list[int] = []
        self._interrupted = self._holding = False
        self._mask: set[int] | None = None

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in ENDING_SIGNALS:
                if signal.getsignal(number) not in (None, signal.SIG_IGN):
                    self._previous[number] = signal.signal(number, self._on_signal)
        return self

    def hold(self) -> None:
        """Hold back every signal until the end of the block."""
        self._holding = True
        if self._previous and self._mask is None:
            self._mask = set(signal.pthread_sigmask(signal.SIG_BLOCK, self._previous))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.hold()
        for number, previous in self._previous.items():
            signal.signal(number, previous)
        ending = self._interrupted or error is not None
        while ending and signal.sigtimedwait(list(self._previous), 0) is not None:
            pass
        if self._mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, self._mask)  # what is still pending is delivered here
        if self._held and not ending:
            self._deliver(self._held[0], None)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._holding or self._interrupted:
            self._held.append(number)
            return
        self._interrupted = True
        self._deliver(number, frame)
        self._interrupted = False  # the program's own handler only took note of it

    def _deliver(self, number: int, frame: FrameType | None) -> None:
        previous = self._previous[number]
        if previous is signal.SIG_DFL:  # it would end the process here and now, with the laser as it is
            raise SystemExit(SIGNAL_BASE + number)
        previous(number, frame)
