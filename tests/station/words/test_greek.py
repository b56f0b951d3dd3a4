"""Greek words: the letter mu, and the spelling of 1982 where the page has it."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.words.greek import has_breathings, monotonic, reading_language, respelt

OLD = "Ἐν ἀρχῇ ἦν ὁ Λόγος, καὶ ὁ Λόγος ἦν πρὸς τὸν Θεόν, καὶ Θεὸς ἦν ὁ Λόγος."
MODERN = "Ο υγρός καιρός φούσκωνε τη μία άκρη, και όποιος μετρά την επιφάνεια ή διαβάζει ποιήματα του Ρήγα."
MISREAD = "Ὁ υγρός καιρὸς φούσκωνε τη μία ἀκρη, καὶ όποιος μετρά τὴν επιφάνεια ή διαβάζει ποιήματα τοῦ Ρήγα."
GREEK_TEXT = st.text(st.characters(min_codepoint=0x370, max_codepoint=0x3FF), min_size=1)
MARKS = "\u0300\u0301\u0308\u0313\u0314\u0342\u0345"
MARKED = st.lists(st.tuples(st.sampled_from("αεηιουωκλφ"), st.sampled_from(["", *MARKS]))).map(
    lambda pairs: unicodedata.normalize("NFC", "".join(letter + mark for letter, mark in pairs))
)


@pytest.mark.parametrize(
    ("old", "modern"),
    [
        ("Ὁ", "Ο"),
        ("καὶ", "και"),
        ("τῶν", "των"),
        ("ὠς", "ως"),
        ("ὥσπου", "ώσπου"),
        ("ἀρχῇ", "αρχή"),
        ("ὑγρὸς", "υγρός"),
        ("πρωΐ", "πρωΐ"),
        ("ή", "ή"),
        ("πού", "πού"),
    ],
)
def test_words_of_the_old_spelling_in_the_new_one(old, modern):
    assert monotonic(old) == modern


@given(MARKED)
def test_the_new_spelling_is_final_and_keeps_the_letters(word):
    once = monotonic(word)
    assert monotonic(once) == once
    bare = [
        "".join(c for c in unicodedata.normalize("NFD", text) if not unicodedata.combining(c)) for text in (word, once)
    ]
    assert bare[0] == bare[1]
    assert not set("\u0300\u0313\u0314\u0342\u0345") & set(unicodedata.normalize("NFD", once))


def test_old_print_is_distinguished_from_modern_print_that_is_misread():
    assert has_breathings(OLD)
    assert not has_breathings(MODERN)
    assert not has_breathings(MISREAD)
    assert not has_breathings("")


def test_a_modern_page_is_spelt_as_printed_but_for_a_missing_accent():
    assert respelt(MISREAD.encode(), MISREAD, "ell").decode() == MODERN.replace("άκρη", "ακρη")
    assert respelt(MODERN.encode(), MODERN, "ell").decode() == MODERN


@pytest.mark.parametrize("language", ["ell", "grc", "Greek"])
def test_a_page_in_the_old_spelling_keeps_it(language):
    assert respelt(OLD.encode(), OLD, language).decode() == OLD


def test_other_data_than_those_of_modern_greek_leave_the_accents():
    assert respelt(MISREAD.encode(), MISREAD, "Greek").decode() == MISREAD


def test_only_words_are_changed_in_xml():
    written = '<span class="ocrx_word" title="bbox 1 2 3 4">καὶ</span>'
    assert respelt(written.encode(), MISREAD, "eng+ell").decode() == written.replace("καὶ", "και")


def test_words_have_the_letter_mu_and_not_the_micro_sign():
    mu, micro = "\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}"
    read = f"γρά{micro}{micro}α {micro}ία 5 {micro}m {micro}Ω"
    spelt = respelt(read.encode(), read, "ell")
    assert spelt.decode() == f"γρά{mu}{mu}α {mu}ία 5 {micro}m {micro}Ω"
    assert respelt(read.encode(), read, "eng+ell") == spelt
    assert respelt(read.encode(), read, "deu") == read.encode()


@given(GREEK_TEXT)
def test_other_languages_are_left_as_they_are(text):
    assert respelt(text.encode(), text, "deu+eng") == text.encode()


@pytest.mark.parametrize(
    ("language", "known", "data"),
    [
        ("ell", ["ell", "Greek"], "ell+Greek"),
        ("eng+ell", ["eng", "ell", "Greek"], "eng+ell+Greek"),
        ("ell", ["ell", "eng"], "ell"),
        ("Greek+ell", ["ell", "Greek"], "Greek+ell"),
        ("grc", ["grc", "Greek"], "grc"),
        ("deu", ["deu", "Greek"], "deu"),
    ],
)
def test_modern_greek_is_read_with_the_data_of_its_script_too(language, known, data):
    assert reading_language(language, known) == data
