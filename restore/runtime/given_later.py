"""Let a field of a data class be given as a function."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

Class = TypeVar("Class", bound=type)


def given_later(*names: str) -> Callable[[Class], Class]:
    """Decorate a data class that has such fields of these names.

    >>> from dataclasses import dataclass
    >>> @given_later("value")
    ... @dataclass(frozen=True)
    ... class Answer:
    ...     value: int
    >>> Answer(lambda: 6 * 7).value, Answer(42).value
    (42, 42)
    """

    def decorated(owner: Class) -> Class:
        for name in names:
            setattr(owner, name, _Field(name))
        return owner

    return decorated


class _Field:
    """The descriptor of such a field."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, instance: object | None, owner: type) -> Any:
        if instance is None:
            return self
        value = instance.__dict__[self._name]
        if callable(value):
            value = instance.__dict__[self._name] = value()
        return value

    def __set__(self, instance: object, value: Any) -> None:
        instance.__dict__[self._name] = value
