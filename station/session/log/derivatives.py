"""Find the files of a restoration."""

from __future__ import annotations

from station.session.log.events import Event
from station.session.terms.parts import PAGE, STEM, parts_of


def file_of(event: Event, part: str, ending: str = ".png") -> str | None:
    """The name of a file of a part in a restoration; None where it has none.

    ending: what follows the stem, as `-coverage.png`.
    """
    alone = len(parts_of(event.facts["result"])) == 1
    name = STEM + ("" if alone or part == PAGE else f"-{part}") + ending
    return name if name in event.files else None
