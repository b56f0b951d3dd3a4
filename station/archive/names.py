"""Names of exported files: by the order of the pages, by their labels, or by a pattern."""

from __future__ import annotations

import re
import string
from collections.abc import Mapping
from typing import Any

from station.archive.volume import UNLABELLED, Page, Volume
from station.errors import UsageError

PATTERNS: Mapping[str, str] = {"number": "{order:04}", "label": "{label}"}
FIELDS = ("order", "capture", "label", "part", "side", "kind")
CLEANED = re.compile(r"[^A-Za-z0-9._-]+")
WIDTH = re.compile(r"\d{0,2}")  # of a field; a larger one would fill the memory
HINT = "use number, label or fields as {order:04}_{label}: " + ", ".join(FIELDS)


def file_names(volume: Volume, pattern: str) -> dict[int, str]:
    """Return page number → first part of the names of its files.

    pattern: number, label, or a text with fields in braces. Raises UsageError for an unknown field, and for names of
    two pages that are equal where a disk makes no difference between upper and lower case.
    """
    text = PATTERNS.get(pattern, pattern)
    names = {page.number: _name(page, text) for page in volume.pages}
    owners = dict[str, int]()
    for number, name in names.items():
        other = owners.setdefault(name.casefold(), number)
        if other != number:
            raise UsageError(f"--names: pages {other} and {number} would both be {name}", "add {order} to the names")
    return names


def _name(page: Page, pattern: str) -> str:
    values: dict[str, Any] = {"order": page.number, "capture": page.capture or page.number}
    values["label"] = page.label or f"{page.kind or UNLABELLED}-{page.number:04}"
    values |= {name: getattr(page, name) for name in FIELDS if name not in values}
    try:
        fields = {name: width for _, name, width, _ in string.Formatter().parse(pattern) if name is not None}
        if not fields or not set(fields) <= set(FIELDS):
            raise UsageError(f"--names: {pattern!r} does not name a page", HINT)
        if not all(WIDTH.fullmatch(width or "") for width in fields.values()):
            raise ValueError("a width has one or two digits")
        name = CLEANED.sub("-", pattern.format(**values)).strip("-.")
    except (ValueError, LookupError, AttributeError) as error:
        raise UsageError(f"--names: {pattern!r} cannot be read: {error}", HINT) from error
    if not name or len(name) > MAX_NAME:
        raise UsageError(f"--names: page {page.number} would have the name {name[:MAX_NAME]!r}", HINT)
    return name


MAX_NAME = 100  # characters: with the ending and the folder it fits every disk
