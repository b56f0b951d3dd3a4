"""Faults of a request: a key, an HTTP status, a sentence, what to do now, the facts."""

from __future__ import annotations

import errno
import re
from collections.abc import Mapping
from typing import Any

from drivers import ScannerError
from drivers.vivid900.errors import PanelError
from restore import BadInput, RestoreError
from station.errors import FolderInUse, StationError, UsageError, explain
from station.session import SessionDamaged
from station.session.operations.corrections import NotForMany

STATUS = {
    "header": 400,
    "host": 421,
    "no_token": 401,
    "wrong_token": 401,
    "foreign_origin": 403,
    "not_found": 404,
    "no_session": 404,
    "no_page": 404,
    "no_words": 404,
    "no_preview": 404,
    "not_recorded": 404,
    "method": 405,
    "timeout": 408,
    "read_only": 409,
    "in_use": 409,
    "session_open": 409,
    "no_session_open": 409,
    "no_scanner": 409,
    "busy": 409,
    "exists": 409,
    "changed": 412,
    "too_large": 413,
    "media_type": 415,
    "invalid": 422,
    "damaged": 422,
    "off_page": 422,
    "fault": 500,
    "streams_full": 503,
    "ending": 503,
    "disk": 507,
}


class ConsoleFault(Exception):
    """Raised by a route for an answer other than what was asked for.

    key   of the table STATUS. data: JSON values that the page shows with the fault.
    """

    def __init__(
        self,
        key: str,
        text: str,
        hint: str = "",
        *,
        status: int | None = None,
        headers: Mapping[str, str] | None = None,
        **data: Any,
    ) -> None:
        super().__init__(text)
        self.key, self.hint, self.data = key, hint, data
        self.status, self.headers = status or STATUS[key], dict(headers or {})

    @classmethod
    def changed(cls, text: str, current: Mapping[str, Any]) -> ConsoleFault:
        """Return the fault of a change to what was changed meanwhile.

        current: what it is now, with its tag.
        """
        headers = {"ETag": f'"{current["tag"]}"'}
        return cls("changed", text, "choose one of the two versions", headers=headers, current=dict(current))

    @property
    def body(self) -> dict[str, Any]:
        """The answer as JSON values."""
        return {"error": {"key": self.key, "text": str(self), "hint": self.hint, "data": self.data}}


WORDS = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
"""Where a word of the name of a class begins."""

# The first class that an error is of decides its key.
KEYS: tuple[tuple[type[BaseException], str], ...] = (
    (FolderInUse, "in_use"),
    (SessionDamaged, "damaged"),
    (UsageError, "invalid"),
    (BadInput, "damaged"),
    (RestoreError, "damaged"),
    (ScannerError, "no_scanner"),
    (OSError, "disk"),
)


def fault_of(error: BaseException) -> ConsoleFault:
    """The fault that describes any error."""
    if isinstance(error, ConsoleFault):
        return error
    explained = explain(error)
    key = next((key for kind, key in KEYS if isinstance(error, kind)), "fault")
    return ConsoleFault(key, explained.message, " ".join(explained.hints), **_facts(error))


def problem_of(error: BaseException) -> dict[str, Any]:
    """Return an error as `text` and `hint` in English, and its `kinds`.

    The page has those in other languages.
    """
    explained = explain(error)
    return {"text": explained.message, "hint": " ".join(explained.hints), "kinds": kinds_of(error)}


def kinds_of(error: BaseException) -> list[str]:
    """Return kinds of an error, narrowest first: panel message, system code, classes."""
    narrow = []
    if isinstance(error, PanelError):
        narrow = ["panel_" + re.sub(r"[^a-z0-9]+", "_", error.panel.lower()).strip("_")]
    elif isinstance(error, OSError) and (code := errno.errorcode.get(error.errno or 0)):
        narrow = [code.lower()]
    classes = [one.__name__ for one in type(error).__mro__ if one not in (BaseException, object)]
    return narrow + [WORDS.sub("_", name).lower() for name in classes]


def _facts(error: BaseException) -> dict[str, Any]:
    if isinstance(error, FolderInUse):
        return {"held_by": error.process}
    return {"field": error.field} if isinstance(error, NotForMany) else {}


REPORTED = (StationError, RestoreError, ScannerError, OSError)
"""Errors that are the operator's business; every other one is a fault of the program."""
