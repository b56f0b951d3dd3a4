"""Make the page labels of a PDF (ISO 32000-1, 12.4.2): ranges where labels count."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from station.session.terms.labels import roman

COUNTED = re.compile(r"(?P<prefix>.*?)(?P<number>[1-9][0-9]{0,6}|[ivxlcdm]+|[IVXLCDM]+|[a-z]|[A-Z])")
ROMAN = {"i": 1, "v": 5, "x": 10, "l": 50, "c": 100, "d": 500, "m": 1000}
MAX_ROMAN = 4999


@dataclass(frozen=True)
class LabelRange:
    """Pages whose labels count on.

    first    index of the first page, from 0.
    style    D, R, r, A or a, as in a PDF; empty for the prefix alone.
    prefix   before the number. start: number of the first page.
    """

    first: int
    style: str
    prefix: str
    start: int = 1

    def label(self, place: int) -> str:
        """Return the label of a page of the range, from 0, as a viewer shows it."""
        number = self.start + place
        shown = {"D": str(number), "r": roman(number), "R": roman(number).upper()}
        if self.style in ("a", "A"):
            letter = chr(ord(self.style) + (number - 1) % 26)
            shown[self.style] = letter * ((number - 1) // 26 + 1)
        return self.prefix + shown.get(self.style, "")


def label_ranges(labels: Sequence[str]) -> list[LabelRange]:
    """Return the ranges that give the labels of all pages of a PDF.

    >>> [(one.first, one.style, one.prefix, one.start) for one in label_ranges(["i", "ii", "1", "2", "3v"])]
    [(0, 'r', '', 1), (2, 'D', '', 1), (4, '', '3v', 1)]
    """
    ranges, at = list[LabelRange](), 0
    while at < len(labels):
        found = [(_length(one, labels), one) for one in _readings(at, labels[at])]
        length, best = max(found, key=lambda pair: pair[0])
        if length == 1 and best.prefix:  # `1r` is not the page r of a run 1
            best = LabelRange(at, "", labels[at])
        ranges.append(best)
        at += length
    return ranges


def _readings(first: int, label: str) -> Iterator[LabelRange]:
    """Yield the ranges that may begin with a label, the plain ones first."""
    match = COUNTED.fullmatch(label)
    if match is None:
        yield LabelRange(first, "", label)
        return
    prefix, text = match["prefix"], match["number"]
    upper = text.isupper()
    readings = []
    if text.isdigit():
        readings.append(LabelRange(first, "D", prefix, int(text)))
    elif 0 < (number := _roman_value(text.lower())) <= MAX_ROMAN:
        readings.append(LabelRange(first, "R" if upper else "r", prefix, number))
    if len(text) == 1 and text.isalpha():
        readings.append(LabelRange(first, "A" if upper else "a", prefix, ord(text.lower()) - ord("a") + 1))
    yield from (one for one in readings if one.label(0) == label)
    yield LabelRange(first, "", label)


def _length(one: LabelRange, labels: Sequence[str]) -> int:
    """Return how many pages a range labels as they are; one without a number."""
    count = 1
    while one.style and one.first + count < len(labels) and one.label(count) == labels[one.first + count]:
        count += 1
    return count


def _roman_value(text: str) -> int:
    values = [ROMAN.get(letter, 0) for letter in text]
    return sum(-one if any(later > one for later in values[at + 1 :]) else one for at, one in enumerate(values))
