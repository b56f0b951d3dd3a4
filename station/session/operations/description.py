"""Describe a volume by title, creators, rights and so on, a page by its side or a note."""

from __future__ import annotations

from collections.abc import Mapping

from station.session.log.current import about_of
from station.session.log.events import VOLUME, Event
from station.session.log.steps import decide
from station.session.log.store import Writer
from station.session.operations.tags import check_tag, description_tag
from station.session.terms.about import ABOUT, About
from station.session.terms.texts import check_text

ACCEPT = "accept"  # which is decided on the scan of a page


def describe(writer: Writer, about: About, *, expected: int | None = None) -> Event | None:
    """Record the description of a volume; nothing where it stays.

    expected: the tag of the one that it was made from. Raises Stale, OSError.
    """
    check_tag(expected, description_tag(writer.session), "the volume was described meanwhile")
    stays = about.given() == about_of(writer.history).given()
    return None if stays else decide(writer, ABOUT, about.given())


def describe_page(writer: Writer, page: int, values: Mapping[str, object]) -> Event | None:
    """Record decisions on a page, or on the volume, by their names; return the last event.

    Raises UsageError for control characters in a text, OSError.
    """
    texts = {name: check_text(name, value) if isinstance(value, str) else value for name, value in values.items()}
    event = None
    for name, value in texts.items():
        on = writer.history.page(page).capture if name == ACCEPT and page != VOLUME else None
        event = decide(writer, name, value, page=page, on=on)
    return event
