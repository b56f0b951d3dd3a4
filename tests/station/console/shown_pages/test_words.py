"""Words over the page, and a search that knows neither case nor accents."""

from __future__ import annotations

from pathlib import Path

import pytest

from station.console.faults import ConsoleFault
from station.console.shown_pages.words import Word, Words, places_of, plain, read_words
from station.session import add_scan, open_session, read_session
from station.session.log.steps import record_run
from station.verdict.packed import PACKED_BYTES, pack
from station.words.words import ALTO
from tests.station.conftest import curl_scan

STRING = '<String CONTENT="{}" HPOS="{}" VPOS="{}" WIDTH="9" HEIGHT="8.4"/>'
LINES = (("Ein", "Größtes"), ("Werk", "über", "Œuvres"))


def alto(lines=LINES) -> bytes:
    strings = "".join(
        "<TextLine>" + "".join(STRING.format(word, 10 * i, 20 * n) for i, word in enumerate(line)) + "</TextLine>"
        for n, line in enumerate(lines)
    )
    return f'<?xml version="1.0"?><alto xmlns="{ALTO}"><Layout>{strings}</Layout></alto>'.encode()


@pytest.fixture
def read(root: Path) -> Path:
    """The session with two pages, the words of the second were read."""
    with open_session(root / "missale") as writer:
        for files in ({}, {"page-alto.xml": alto()}):
            capture = add_scan(writer, curl_scan(), facts={"by": "a test"})
            folder = writer.staging("restore")
            folder.mkdir(parents=True)
            for name, data in files.items():
                (folder / name).write_bytes(data)
            record_run(writer, "restore", capture, parameters={}, result={"page_mm": [1, 1]}, files=folder)
    return root


def test_words_are_shown_and_found(read, client):
    client.post("/api/sessions/missale/open", json={"read_only": True})
    words = client.get("/api/pages/2/words").json()["words"]
    assert words[1] == {"text": "Größtes", "x": 10, "y": 0, "w": 9, "h": 8, "line": 0}
    assert client.get("/api/pages/2").json()["words"] is True
    assert client.get("/api/pages/1/words").json()["error"]["key"] == "no_words"
    found = client.get("/api/search", params={"q": "GROSSTES werk"}).json()
    assert (found["pages_with_words"], found["pages"]) == (1, 2)
    text = "Ein Größtes Werk über Œuvres"
    assert found["hits"] == [{"page": 2, "part": "", "label": "2", "words": [1, 2], "text": text}]
    assert client.get("/api/search", params={"q": "absent"}).json()["hits"] == []
    assert client.get("/api/search", params={"q": " "}).json()["hits"] == []
    assert client.get("/api/search", params={"q": ""}).status_code == 422


def test_words_of_both_leaves_of_an_opened_book_are_shown_and_found(root, client):
    with open_session(root / "missale") as writer:
        capture = add_scan(writer, curl_scan(), facts={"by": "a test"})
        folder = writer.staging("restore")
        folder.mkdir(parents=True)
        for part, word in (("left", "verso"), ("right", "recto")):
            (folder / f"page-{part}-alto.xml").write_bytes(alto([(word, "folium")]))
        measures = {"fingerprint": pack(bytes(PACKED_BYTES))}
        parts = {part: {"page_mm": [1, 1], "measures": measures} for part in ("left", "right")}
        record_run(writer, "restore", capture, parameters={}, result={"parts": parts}, files=folder)
    client.post("/api/sessions/missale/open", json={"read_only": True})
    for leaf, word in (("left.", "verso"), ("right.", "recto")):
        words = client.get("/api/pages/1/words", params={"leaf": leaf}).json()["words"]
        assert [one["text"] for one in words] == [word, "folium"]
    assert client.get("/api/pages/1/words").json()["error"]["key"] == "no_words"
    assert client.get("/api/pages/1").json()["words"] is True
    found = client.get("/api/search", params={"q": "recto"}).json()
    assert (found["pages_with_words"], [(hit["part"], hit["words"]) for hit in found["hits"]]) == (1, [("right", [0])])
    both = client.get("/api/search", params={"q": "folium"}).json()["hits"]
    assert [hit["part"] for hit in both] == ["left", "right"]
    assert both[0]["label"] != both[1]["label"]


def test_a_phrase_is_found_at_every_place():
    assert places_of(["a", "b"], ["a", "ab", "b", "a"]) == [0, 1]
    assert places_of(["a"], []) == []
    assert plain("ÉTÉ ﬂo") == "ete flo"


@pytest.mark.parametrize(
    "data",
    [
        b"noise",
        b'<!DOCTYPE a [<!ENTITY b "c">]>' + alto(),
        alto().replace(b'HPOS="10"', b'HPOS="x"'),
        alto().replace(b'HPOS="10"', b'HPOS="inf"'),
        alto().replace(b'HPOS="10"', b""),
        alto()[:-20],
    ],
)
def test_a_file_that_someone_prepared_is_refused(tmp_path, data):
    (tmp_path / "a.xml").write_bytes(data)
    with pytest.raises(ConsoleFault, match="damaged"):
        read_words(tmp_path / "a.xml")


def test_words_are_kept_within_a_limit(read):
    session = read_session(read / "missale")
    event = session.history.event(5)
    words = Words(limit=1)
    first, _ = words.of(session, event)
    assert first[0] == Word("Ein", 0, 0, 9, 8, 0)
    assert words.of(session, event)[0] is first
