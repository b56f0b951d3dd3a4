"""Greek print: the data to read it with, and corrections.

The corrections need no picture. Tesseract's data of the language (`ell`) and of the script (`Greek`) miss different
words, and both together fewer than either. Both know the print of all times and put breathings and graves on words in
the spelling of 1982, which has none; and they write the sign of a micrometre for the letter mu, which no search for the
word finds.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection

MODERN, SCRIPT = "ell", "Greek"
NAMES = frozenset({MODERN, SCRIPT, "grc"})
SMALL = "\u03ac-\u03ce\u1f00-\u1fff"
MICRO_IN_WORD = f"(?<=[{SMALL}])\u00b5|\u00b5(?=[{SMALL}])"  # next to a small letter, not a capital: a microohm stays
WORD = "[\u0370-\u03ff\u1f00-\u1fff]+"
# Words of the old spelling that begin with a vowel all have a breathing; of today's one in ten is read with one.
MAX_BREATHED = 0.5
VOWELS = "αεηιουω"
SYLLABLE = f"(?:αι|ει|οι|υι|αυ|ευ|ηυ|ου|[{VOWELS}])"
PSILI, DASIA, IOTA = "\u0313", "\u0314", "\u0345"
GRAVE, CIRCUMFLEX, ACUTE = "\u0300", "\u0342", "\u0301"


def reading_language(language: str, known: Collection[str]) -> str:
    """Return the data to read a language with, joined by +.

    Those of modern Greek with those of the script, where known.
    """
    parts = language.split("+")
    return f"{language}+{SCRIPT}" if MODERN in parts and SCRIPT not in parts and SCRIPT in known else language


def respelt(data: bytes, text: str, language: str) -> bytes:
    """Return Tesseract's output with corrected Greek.

    With the letter mu, and in today's spelling where the page has that and is read as modern Greek.
    data: UTF-8, plain or XML, of a page with a text.
    """
    names = language.split("+")
    if NAMES.isdisjoint(names):
        return data
    spelt = re.sub(MICRO_IN_WORD, "\N{GREEK SMALL LETTER MU}", data.decode("utf-8"))
    if MODERN in names and not has_breathings(text):
        spelt = re.sub(WORD, lambda word: monotonic(word[0]), spelt)
    return spelt.encode("utf-8")


def has_breathings(text: str) -> bool:
    """Return whether words that begin with a vowel have breathings.

    They had them before 1982.
    """
    letters = [unicodedata.normalize("NFD", word) for word in re.findall(WORD, text)]
    begun = [word for word in letters if word[0].lower() in VOWELS]
    breathed = [word for word in begun if re.search(f"[{PSILI}{DASIA}]", word)]
    return len(breathed) > MAX_BREATHED * len(begun)


def monotonic(word: str) -> str:
    """Return a Greek word in the spelling of 1982.

    No breathings, one accent, and that on words of two syllables or more. A word of one syllable keeps the acute, which
    some have to this day; graves and circumflexes it loses.
    """
    marks = re.sub(f"[{PSILI}{DASIA}{IOTA}]", "", unicodedata.normalize("NFD", word))
    letters = re.sub("[\u0300-\u0345]", "", marks).lower()
    accent = ACUTE if len(re.findall(SYLLABLE, letters)) > 1 else ""
    return unicodedata.normalize("NFC", re.sub(f"[{GRAVE}{CIRCUMFLEX}]", accent, marks))
