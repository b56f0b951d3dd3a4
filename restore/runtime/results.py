"""Results that are kept, so that a page is not computed again.

A result is found by a digest of all that it was computed from, so that it cannot be that of other input.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from io import BytesIO
from typing import Any, TypeVar

MAX_BYTES = 2**29  # of the results that are kept

Result = TypeVar("Result")


class Kept:
    """Results of the page that was restored last.

    Those that its next restoration does not use go, and all go before another page is restored.

    >>> kept = Kept()
    >>> with kept.of_page("page.scan"):
    ...     kept.result(pow, 2, 10)
    1024
    """

    def __init__(self) -> None:
        self._page: object = None
        self._results: dict[bytes, tuple[Any, int]] = {}
        self._used: set[bytes] = set()

    def __len__(self) -> int:
        return len(self._results)

    @contextmanager
    def of_page(self, page: object) -> Iterator[None]:
        """Keep results while a page is restored.

        page: by what it is known, its path for example.
        """
        if page != self._page:
            self._results.clear()
        self._page, self._used = page, set()
        try:
            yield
        finally:
            self._results = {key: one for key, one in self._results.items() if key in self._used}

    def result(self, function: Callable[..., Result], *arguments: Any, aside: tuple[Any, ...] = ()) -> Result:
        """Return function(*arguments, *aside), or what it returned for equal arguments.

        function: of a module. Its result depends on nothing but the arguments, and is never changed.
        aside: further arguments, which change no result: a clock.
        """
        key = _digest((function, arguments))
        if key in self._results:
            self._used.add(key)
            found: Result = self._results[key][0]
            return found
        result = function(*arguments, *aside)
        if key:
            self._put(key, result)
        return result

    def _put(self, key: bytes, result: object) -> None:
        size = sum(part.nbytes for part in _parts(result))
        if size and size + sum(kept for _, kept in self._results.values()) <= MAX_BYTES:
            self._results[key] = result, size
            self._used.add(key)


class _Fields(pickle.Pickler):
    """Writes the fields of data classes alone: what they cache does not count."""

    def reducer_override(self, obj: Any) -> Any:
        if is_dataclass(obj) and not isinstance(obj, type):
            return type(obj), tuple(getattr(obj, one.name) for one in fields(obj))
        return NotImplemented


def _digest(value: object) -> bytes:
    """Return the digest of a value, empty for one that cannot be written.

    Values of one digest are equal. Equal ones may have two, if one of them refers twice to one object.
    """
    parts = _parts(value)
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return digest.digest() if parts else b""


def _parts(value: object) -> list[memoryview]:
    """Return a value as it is written, its arrays apart and not copied.

    Nothing for a value that cannot be written.
    """
    written, arrays = BytesIO(), list[pickle.PickleBuffer]()
    try:
        _Fields(written, protocol=5, buffer_callback=arrays.append).dump(value)
    except (pickle.PicklingError, AttributeError, TypeError):
        return []
    return [written.getbuffer(), *(one.raw() for one in arrays)]
