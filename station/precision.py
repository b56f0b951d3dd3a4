"""How well a page was read: words and characters against what is printed on it.

The paper's Table 1 gives word and character precision without a definition. Here what was read is aligned with what is
printed, in order, by the fewest insertions, deletions and substitutions (Levenshtein): each is an error. Precision is
the share without error of what is printed or of what was read, whichever is more, so that neither words left out nor
words made up can help. Case and punctuation count; white space is one space wherever it stands.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

from rapidfuzz.distance import Levenshtein


@dataclass(frozen=True)
class Reading:
    """right: words or characters without error; of: how many are printed or were read, whichever is more."""

    right: int
    of: int

    @property
    def precision(self) -> float:
        """Share that was read right, 0 to 1; 1 for a blank page of which nothing was read."""
        return self.right / self.of if self.of else 1.0

    def __add__(self, other: Reading) -> Reading:
        return Reading(self.right + other.right, self.of + other.of)


def read_words(printed: str, read: str) -> Reading:
    """Words of `read` against those of `printed`."""
    return _reading(_words(printed), _words(read))


def read_characters(printed: str, read: str) -> Reading:
    """Characters, spaces between words among them."""
    return _reading(" ".join(_words(printed)), " ".join(_words(read)))


def _words(text: str) -> list[str]:
    """Words in one spelling of letters: ligatures and accents composed alike (NFKC)."""
    return unicodedata.normalize("NFKC", text).split()


def _reading(printed: Sequence[Hashable], read: Sequence[Hashable]) -> Reading:
    longer = max(len(printed), len(read))
    return Reading(longer - Levenshtein.distance(printed, read), longer)
