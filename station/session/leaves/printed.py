"""Compare labels with the numbers at the head and foot of the pages."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from restore.scan import Bytes
from station.images.pages import StoredPage, read_page
from station.progress import Progress, silent
from station.session.leaves.leaf import leaves_of, picture_of
from station.session.log.store import Session
from station.session.terms.labels import numbers_in

BAND = 1 / 8  # of the height of a page, at head and foot: running heads and page numbers are there
NUMBER = re.compile(r"[\[(–—-]*\s*(?P<number>\d{1,4}|[ivxlc]{1,8}|[IVXLC]{1,8})\s*[rvab]?\s*[\])–—.-]*")

Read = Callable[[Bytes, float], str]
"""Text in an image (h, w, 3) uint8 RGB with its pixels per inch."""


@dataclass(frozen=True)
class Printed:
    """A leaf side, its label, and the number that is printed on it; empty where none was read."""

    name: str
    label: str
    printed: str

    @property
    def differs(self) -> bool:
        """Whether another number is printed than the label has."""
        return bool(self.printed) and numbers_in(self.label).isdisjoint(numbers_in(self.printed))


def printed_numbers(session: Session, read: Read, progress: Progress = silent) -> Iterator[Printed]:
    """Yield the restored leaf sides with labels and printed numbers.

    Nothing is recorded. Raises BadInput for a page that is damaged, and what `read` raises.
    """
    leaves = [leaf for leaf in leaves_of(session) if not leaf.is_left_out]
    for done, leaf in enumerate(leaves):
        progress("words", done / len(leaves))
        path = picture_of(session, leaf)
        if path is not None and leaf.label:
            yield Printed(leaf.name, leaf.label, printed_on(read_page(path), read))
    progress("words", 1.0)


def printed_on(page: StoredPage, read: Read) -> str:
    """Return the number in a line of its own at the head or foot of a page.

    A line that holds a running title has it at one of its ends. Empty without one, or where several differ.
    """
    height = max(round(page.image.shape[0] * BAND), 1)
    bands = page.image[:height], page.image[-height:]
    lines = [line.split() for band in bands for line in read(band, page.dpi).splitlines() if line.strip()]
    alone = {match["number"] for words in lines if (match := NUMBER.fullmatch(" ".join(words)))}
    ends = {word for words in lines for word in (words[0], words[-1]) if word.isdecimal()}
    found = alone or ends
    return found.pop() if len(found) == 1 else ""
