"""Words of a page and their places, and a search over all pages with words."""

from __future__ import annotations

import unicodedata
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from restore.files import read_regular
from station.console.faults import ConsoleFault
from station.console.shown_pages.layers import PREFIXES, file_of_leaf, stored_file
from station.console.shown_pages.rows import WORDS, Row
from station.session import Event, Session
from station.words.words import ALTO as NAMESPACE
from station.words.words import PLACES

MAX_ALTO_BYTES = 2**25  # of a page: a newspaper's has two megabytes
MAX_KEPT_WORDS = 2_000_000  # of all pages that are kept: some hundred bytes each
MAX_HITS = 500  # pages
CONTEXT = 4  # words before and after a hit


@dataclass(frozen=True)
class Word:
    """A word. x, y, w, h: pixels of the page; line: number of its line."""

    text: str
    x: int
    y: int
    w: int
    h: int
    line: int


def read_words(path: Path) -> list[Word]:
    """The words of an ALTO file. Raises ConsoleFault for a file that is damaged, OSError."""
    data = read_regular(path, MAX_ALTO_BYTES)
    try:
        if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
            raise ValueError("it declares entities, as no file of ours does")
        root, found = ElementTree.fromstring(data), list[Word]()
        for number, line in enumerate(root.iter(f"{{{NAMESPACE}}}TextLine")):
            for word in line.iter(f"{{{NAMESPACE}}}String"):
                x, y, w, h = (round(float(word.attrib[name])) for name in PLACES)
                found.append(Word(word.attrib["CONTENT"], x, y, w, h, number))
    except (ElementTree.ParseError, ValueError, LookupError, OverflowError) as error:
        raise ConsoleFault("damaged", f"{path} is damaged: {error}", "planish verify shows more") from error
    return found


def plain(text: str) -> str:
    """A text without case and accents, as it is searched.

    >>> plain("Größe ﬁnal")
    'grosse final'
    """
    decomposed = unicodedata.normalize("NFKD", text.casefold())
    return "".join(character for character in decomposed if not unicodedata.combining(character))


def places_of(query: Sequence[str], words: Sequence[str]) -> list[int]:
    """Where a phrase begins among plain words: each part within the word at its place."""
    last = len(words) - len(query)
    return [at for at in range(last + 1) if all(part in words[at + i] for i, part in enumerate(query))]


class Words:
    """The words of the pages that were asked for last."""

    def __init__(self, limit: int = MAX_KEPT_WORDS) -> None:
        self._limit = limit
        self._kept: OrderedDict[tuple[str, int, str], tuple[list[Word], list[str]]] = OrderedDict()

    def of(self, session: Session, event: Event, leaf: str = "") -> tuple[list[Word], list[str]]:
        """Return the words of a restoration, and as they are searched.

        leaf: before the names of its layers. Raises ConsoleFault when none were read.
        """
        name = file_of_leaf(leaf, WORDS)
        if name not in event.files:
            raise ConsoleFault("no_words", "the words of this page were not read", 'a preset with outputs = ["ocr"]')
        key = (session.identifier, event.number, leaf)
        found = self._kept.get(key)
        if found is None:
            words = read_words(stored_file(session, event, name))
            found = self._kept[key] = (words, [plain(word.text) for word in words])
            while len(self._kept) > 1 and sum(len(one[0]) for one in list(self._kept.values())) > self._limit:
                self._kept.popitem(last=False)
        return found

    def search(self, session: Session, rows: Sequence[Row], query: str) -> dict[str, Any]:
        """Find the pages with a phrase, its words' numbers and the text around the first."""
        parts, hits, read = plain(query).split(), list[dict[str, Any]](), 0
        for row in rows:
            event = None if row["restore"] is None else session.history.event(row["restore"])
            leaves = [] if event is None else [leaf for leaf in PREFIXES if file_of_leaf(leaf, WORDS) in event.files]
            read += bool(leaves)
            for leaf in leaves:
                assert event is not None
                words, searched = self.of(session, event, leaf)
                places = places_of(parts, searched) if parts else []
                if places and len(hits) < MAX_HITS:
                    numbers = sorted({at + i for at in places for i in range(len(parts))})
                    around = words[max(places[0] - CONTEXT, 0) : places[0] + len(parts) + CONTEXT]
                    hits.append({**_place(row, leaf), "words": numbers, "text": " ".join(one.text for one in around)})
        return {"query": query, "hits": hits, "pages_with_words": read, "pages": len(rows)}


def _place(row: Row, leaf: str) -> dict[str, Any]:
    """The page and the leaf of a hit, with its label."""
    part = leaf.removesuffix(".")
    labels = {one["part"]: one.get("label") for one in row["parts"]}
    return {"page": row["page"], "part": part, "label": labels.get(part) or row["label"]}


def as_json(words: Sequence[Word]) -> dict[str, Any]:
    """Words as JSON values."""
    return {"words": [asdict(word) for word in words]}
