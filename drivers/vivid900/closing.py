"""What must be brought to rest on every way out of a `with` block."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import ClassVar, Self

from drivers.scanner import ScannerError


class Closing(ABC):
    """A device that its `with` block closes. A fault on the way out never hides the one that led there.

    unrest  what is told, beside that one, of a device that could not be closed.
    """

    unrest: ClassVar[str]

    @abstractmethod
    def close(self) -> None:
        """Bring it to rest and let it go. Safe to call twice."""

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
            error.add_note(f"{self.unrest}: {fault}")
