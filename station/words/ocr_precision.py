"""Precision of recognised text: words and characters against the transcript of the page.

The paper's Table 1 gives word and character precision without a definition. Here the recognised text is aligned with
the transcript, in order, by the fewest insertions, deletions and substitutions (Levenshtein): each is an error.
Precision is 1 minus errors over the length of the longer of the two, so that neither missing nor surplus words can
raise it. Case and punctuation count; white space is one space wherever it stands.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

from rapidfuzz.distance import Levenshtein


@dataclass(frozen=True)
class MatchCount:
    """Counts of matches.

    correct: words or characters without error.
    total: number in the transcript or the result, the larger of both.
    """

    correct: int
    total: int

    @property
    def precision(self) -> float:
        """Return the fraction of correct items, 0 to 1, 1 for a blank page with an empty result."""
        return self.correct / self.total if self.total else 1.0

    def __add__(self, other: MatchCount) -> MatchCount:
        return MatchCount(self.correct + other.correct, self.total + other.total)


def count_matching_words(printed: str, read: str) -> MatchCount:
    """Count of the words of `read` that match those of the transcript `printed`."""
    return _count_matches(_words(printed), _words(read))


def count_matching_characters(printed: str, read: str) -> MatchCount:
    """Count of matching characters, one space between words included."""
    return _count_matches(" ".join(_words(printed)), " ".join(_words(read)))


def _words(text: str) -> list[str]:
    """Words in one spelling of letters: ligatures and accents composed alike (NFKC)."""
    return unicodedata.normalize("NFKC", text).split()


def _count_matches(printed: Sequence[Hashable], read: Sequence[Hashable]) -> MatchCount:
    longer = max(len(printed), len(read))
    return MatchCount(longer - Levenshtein.distance(printed, read), longer)
