"""A page that reads worse without its light keeps it, and says so."""

from types import SimpleNamespace

import pytest

from station.words import words_lost as module
from station.words.words_lost import words_lost


def read(text, confidence):
    return SimpleNamespace(text=text, confidence=confidence)


@pytest.mark.parametrize(
    ("removed", "kept", "without", "lost"),
    [
        (True, read("one two three four", 95.0), read("one three", 95.0), True),
        (True, read("one two three four", 95.0), read("ome tvo threc fovr", 40.0), True),
        (True, read("one two", 95.0), read("one two three four", 95.0), False),
        (True, read("one two three four", 95.0), read("one two three four", 94.0), False),
        (False, read("one two three four", 95.0), read("", 0.0), False),
    ],
)
def test_only_a_page_that_reads_worse_without_its_light_loses_words(monkeypatch, removed, kept, without, lost):
    monkeypatch.setattr(module, "recognise", lambda *_args, **_names: kept)
    page = SimpleNamespace(report={"light": {"removed": removed}}, master=None, dpi=150.0)
    findings = words_lost(page, without, language="eng")
    assert [one.code for one in findings] == ["light_kept"] * lost
