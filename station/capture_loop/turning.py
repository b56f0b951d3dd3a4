"""Find which opening a scanner that turns leaves is to show: the session alone says.

A server that was killed goes on at the right leaf. A page that was added without the scanner counts as an opening, too.
"""

from __future__ import annotations

from typing import NamedTuple

from drivers import Scanner, Turner
from station.session import History
from station.session.log.history import CAPTURE


class Place(NamedTuple):
    """An opening of the volume, counted from 0, and how often it was captured before."""

    opening: int
    attempt: int


def place_of(history: History, page: int | None) -> Place:
    """Return the place of the next capture of a page.

    page: None for a new one, even if inserted.

    >>> place_of(History(), None)
    Place(opening=0, attempt=0)
    """
    captured = [one.number for one in history.pages()]
    if page is None:
        return Place(len(captured), 0)
    attempts = sum((event.page, event.kind) == (page, CAPTURE) for event in history.events)
    return Place(sum(number < page for number in captured), attempts)


def stay(_place: Place) -> None:
    """Leave the leaves as they lie: the operator has turned them."""


def turn(scanner: Scanner, place: Place) -> None:
    """Turn the leaves to a place, where the scanner does. Raises ScannerError."""
    if isinstance(scanner, Turner):
        scanner.turn_to(*place)
