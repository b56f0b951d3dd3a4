"""Names of exported files are those of the pages, and no two are the same."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest

from station.archive.names import file_names
from station.archive.volume import Page, Volume
from station.errors import UsageError


def volume(*labels):
    pages = tuple(Page(number, label, (), part="left", capture=7) for number, label in enumerate(labels, 1))
    return Volume("id", "A", pages, (), datetime(2026, 1, 1, tzinfo=UTC))


def test_names_are_cleaned():
    assert file_names(volume("1r", "1v"), "number") == {1: "0001", 2: "0002"}
    assert file_names(volume("12v–13r", "[3]"), "label") == {1: "12v-13r", 2: "3"}
    assert file_names(volume("", "2"), "label") == {1: "unlabelled-0001", 2: "2"}
    assert file_names(volume("../../a"), "{order:04}_{label}_{capture}-{part}") == {1: "0001_..-..-a_7-left"}


@pytest.mark.parametrize(
    ("labels", "pattern", "reason"),
    [
        (("1", "1"), "label", "pages 1 and 2 would both be 1"),
        (("a", "A"), "label", "pages 1 and 2"),
        (("1",), "page", "does not name a page"),
        (("1",), "{files}", "does not name a page"),
        (("1",), "{label.__class__}", "does not name a page"),
        (("1",), "{label", "cannot be read"),
        (("1",), "{order:zz}", "cannot be read"),
        (("1",), "{order:999999999}", "cannot be read"),
        (("…",), "label", "would have the name"),
        (("1" * 101,), "label", "would have the name"),
    ],
)
def test_what_cannot_be_a_name_is_refused(labels, pattern, reason):
    with pytest.raises(UsageError, match=reason):
        file_names(volume(*labels), pattern)
