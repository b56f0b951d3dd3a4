"""What a session shows of itself."""

from __future__ import annotations

from station.session import add_scan, open_session, undo
from station.session.leaves.leaf import missing_labels
from station.session.leaves.overview import overview, overview_lines
from station.session.log.steps import decide


def test_pages_are_listed_in_their_order_with_their_labels(volume, tiny_scan):
    with open_session(volume) as writer:
        for _ in range(3):
            add_scan(writer, tiny_scan, facts={})
        decide(writer, "position", 1.5, page=3)
        decide(writer, "label", "iv", page=1)
        decide(writer, "note", "gone again", page=2)
        undo(writer)
        reported, lines = overview(writer.session), list(overview_lines(writer.session))
    assert [(page["page"], page["label"], page["note"]) for page in reported["pages"]] == [
        (1, "iv", ""),
        (3, "2", ""),
        (2, "3", ""),
    ]
    assert lines[-2:] == ["undo: label of page 1", "redo: note of page 2"]


def test_a_page_is_one_line_whatever_its_label_and_note_hold(volume, tiny_scan):
    with open_session(volume) as writer:
        add_scan(writer, tiny_scan, facts={})
        decide(writer, "label", "a\nb", page=1)
        decide(writer, "note", "torn\n\tat the top", page=1)
        line = next(line for line in overview_lines(writer.session) if line.startswith("       1"))
    assert line.split() == ["1", "a", "b", "new", "torn", "at", "the", "top"]


def test_an_empty_session(volume):
    with open_session(volume) as writer:
        assert list(overview_lines(writer.session)) == ["A volume  tests", f"{volume}, 0 pages, 1 events, preset book"]


def test_gaps_between_labels_are_reported(volume, tiny_scan):
    with open_session(volume) as writer:
        for _ in range(3):
            add_scan(writer, tiny_scan, facts={})
        assert missing_labels(writer.session) == []
        decide(writer, "label", "5", page=3)
        assert missing_labels(writer.session) == ["between 2 and 5"]
        assert "pages are missing between 2 and 5" in list(overview_lines(writer.session))
        decide(writer, "label", "plate", page=3)
        assert missing_labels(writer.session) == []
