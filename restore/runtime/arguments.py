"""Types of the arguments of the public API, checked in one place.

A caller without a type checker would otherwise meet an AttributeError deep inside. Annotations give the types; the
contents of an array are checked by the function, which knows its shape and unit.
"""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

Given = ParamSpec("Given")
Answer = TypeVar("Answer")
COLLECTED = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
ARRAY_LIKE = (np.ndarray, list, tuple)
WIDER: dict[type, tuple[type, ...]] = {float: (Real,), int: (Real,), Path: (os.PathLike,)}


def checks_types(function: Callable[Given, Answer]) -> Callable[Given, Answer]:
    """Make a function check the types of its arguments.

    It raises TypeError with a clear sentence for an argument of another type than it is annotated.

    >>> @checks_types
    ... def double(number: float) -> float:
    ...     return 2 * number
    >>> double("2")
    Traceback (most recent call last):
        ...
    TypeError: double() takes a float as number, not 'str'
    """
    signature = inspect.signature(function)

    @functools.wraps(function)
    def checked(*args: Given.args, **kwargs: Given.kwargs) -> Answer:
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError:  # too many arguments or too few: the call itself reports them
            given = {}
        for name, value in given.items():
            if signature.parameters[name].kind not in COLLECTED:
                _check(function, name, value)
        return function(*args, **kwargs)

    return checked


def _check(function: Callable[..., Any], name: str, value: Any) -> None:
    wanted = _hints(function).get(name, Any)
    if not _fits(value, wanted):
        kinds = " or ".join(_named(wanted))
        given = repr(type(value).__name__)
        if isinstance(value, (list, tuple)) and value:
            given += f" of {type(value[0]).__name__!r}"
        raise TypeError(f"{function.__name__}() takes {kinds} as {name}, not {given}{_remedy(kinds, value)}")


@functools.cache
def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    return get_type_hints(function)


def _fits(value: Any, wanted: Any) -> bool:
    """Whether a value is of a type, and the items of a sequence of theirs."""
    origin, items = get_origin(wanted), get_args(wanted)
    if origin in (Union, UnionType):
        return any(_fits(value, one) for one in items)
    if origin is np.ndarray:
        return isinstance(value, ARRAY_LIKE)
    if origin is Sequence:
        array = isinstance(value, np.ndarray) and items[0] in WIDER  # of numbers is as good
        listed = isinstance(value, Sequence) and not isinstance(value, str)
        return array or (listed and all(_fits(one, items[0]) for one in value))
    if origin is Mapping:
        return isinstance(value, Mapping)
    if origin is Callable:
        return callable(value)
    return wanted is Any or not isinstance(wanted, type) or isinstance(value, WIDER.get(wanted, (wanted,)))


def _named(wanted: Any) -> list[str]:
    origin, items = get_origin(wanted), get_args(wanted)
    if origin in (Union, UnionType):
        return [name for one in items for name in _named(one)]
    if origin is np.ndarray:
        return ["an array"]
    if origin is Sequence:
        return [
            f"a sequence of {' or '.join(name.removeprefix('a ').removeprefix('an ') for name in _named(items[0]))}"
        ]
    if origin is Callable:
        return ["a function"]
    if wanted is NoneType:
        return ["None"]
    name = getattr(origin or wanted, "__name__", str(wanted))
    return [f"an {name}" if name[0] in "aeiouAEIOU" else f"a {name}"]


def _remedy(kinds: str, value: Any) -> str:
    """What to do about the name of a file in the place of what it holds."""
    named = isinstance(value, (str, os.PathLike)) and "SurfaceMesh" in kinds
    return ": read the file with load_scan" if named else ""
