"""Base class of devices that a `with` block closes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import ClassVar, Self

from drivers.scanner import ScannerError


class DeviceContext(ABC):
    """Device that its `with` block closes.

    An error on closing never hides the error that ended the block.
    close_failure  text of the note that is added to that error when closing fails as well.
    """

    close_failure: ClassVar[str]

    @abstractmethod
    def close(self) -> None:
        """Make it safe and close the connection. Safe to call twice."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except ScannerError as fault:
            if error is None:
                raise
            error.add_note(f"{self.close_failure}: {fault}")
            for note in getattr(fault, "__notes__", ()):
                error.add_note(note)
