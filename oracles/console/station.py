"""A station of canned answers: states that a real one takes long to reach.

Any number of pages, a dense scan, a laser that is on, a crash to recover from. What is pressed is recorded and changes
nothing.
"""

from __future__ import annotations

import json
import queue
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from PIL import Image

from oracles.console.answers import ANSWERS, Values, detail, leaf, open_state, reviewed, row, words
from oracles.console.models import model
from oracles.console.pictures import deep_zoom, encoded, layer, on_table, printed_page, tile, warned

SOUGHT = "crease"  # the word that the search finds, whatever it is asked for
BEAT_S = 0.1  # between two looks whether a listening page is still there
TYPES = {
    ".js": "text/javascript",
    ".css": "text/css",
    ".html": "text/html",
    ".json": "application/json",
    ".svg": "image/svg+xml",
}
Answer = tuple[bytes, str]
"""Bytes and their media type."""


@dataclass
class CannedStation:
    """What the station answers.

    page      the folder of the console's page. pages: how many the session has. points: of a scan.
    state     of /api/state. preview, jobs, sessions: None for those of the table.
    pressed   the bodies of all requests that change something, with their paths.
    rows      what differs in the row of a page. unrecorded: kinds of models that no restoration has kept.
    leaves    of the contact sheet.
    """

    page: Path
    pages: int = 10
    points: int = 20_000
    state: Values = field(default_factory=dict)
    preview: Values | None = None
    jobs: list[Values] = field(default_factory=list)
    sessions: list[Values] | None = None
    pressed: list[tuple[str, Values]] = field(default_factory=list)
    rows: dict[int, Values] = field(default_factory=dict)
    unrecorded: set[str] = field(default_factory=set)
    leaves: list[Values] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.state = self.state or open_state(self.pages)
        self.leaves = self.leaves or [leaf(number) for number in range(1, self.pages + 1)]
        self.sheet = Image.fromarray(printed_page().image)
        self._layers: dict[str, Image.Image] = {}
        self.listeners: list[queue.SimpleQueue[bytes]] = []

    def send(self, name: str, data: Any) -> None:
        """Send an event to every page that listens."""
        for listener in list(self.listeners):
            listener.put(f"event: {name}\ndata: {json.dumps(data)}\n\n".encode())

    def change(self, **values: Any) -> None:
        """Change the state, merging values into its tables, and send it."""
        for name, value in values.items():
            old = self.state.get(name)
            self.state[name] = {**old, **value} if isinstance(old, dict) and isinstance(value, dict) else value
        self.send("state", self.state)

    def events(self) -> Iterator[bytes]:
        """The events for one page; a comment while nothing happens."""
        listener: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self.listeners.append(listener)
        try:
            yield b'retry: 200\nevent: hello\ndata: {"boot": "canned", "last": 0}\n\n'
            while True:
                try:
                    yield listener.get(timeout=BEAT_S)
                except queue.Empty:
                    yield b": beat\n\n"
        finally:
            self.listeners.remove(listener)

    def row(self, number: int) -> Values:
        """The row of a page."""
        return {**row(number), **self.rows.get(number, {})}

    def missing(self, path: str) -> Values:
        """The fault for a path that nothing is at."""
        key = "not_recorded" if path.startswith("/api/models/") else "not_found"
        return {"error": {"key": key, "text": "not there", "hint": ""}}

    def arrange(self, body: Values) -> Values:
        """Move leaves of the contact sheet, or change one; no window is ahead of another."""
        moved = [one for name in body.get("leaves", ()) for one in self.leaves if one["name"] == name]
        rest = [one for one in self.leaves if one not in moved]
        at = next((at for at, one in enumerate(rest) if one["name"] == body.get("before")), len(rest))
        self.leaves = [*rest[:at], *moved, *rest[at:]]
        for one in self.leaves:
            if one["name"] == body.get("leaf"):
                one.update({key: value for key, value in body.items() if key in ("label", "left_out")})
        return {"tag": 0, "leaves": self.leaves}

    def answer(self, path: str) -> Values | None:
        """The JSON of a path, None for none."""
        if found := re.fullmatch(r"/api/pages/(\d+)(/words)?", path):
            return {"words": words()} if found[2] else detail(self.row(int(found[1])), self.sheet.size)
        if found := re.fullmatch(r"/api/pages/(\d+)/(edits|layout)", path):
            return {**ANSWERS[found[2]], "page": int(found[1])}
        if path == "/api/preview":
            return self.preview
        if found := re.search(r"/(measure|strain|coverage|uncertainty)(?:/scale|/legend)?$", path):
            return dict(ANSWERS[found[1]])
        answer = self._lists().get(path)
        return None if answer is None else answer()

    def _lists(self) -> dict[str, Callable[[], Values]]:
        at = next(i for i, word in enumerate(words()) if word["text"] == SOUGHT)
        hit = {"page": 2, "part": "", "label": "2", "words": [at], "text": f"… {SOUGHT} …"}
        return {
            "/api/state": lambda: self.state,
            "/api/pages": lambda: {
                "pages": [self.row(n) for n in range(1, self.pages + 1)],
                "current": self.pages or None,
            },
            "/api/leaves": lambda: {"tag": 0, "leaves": self.leaves},
            "/api/review": lambda: {"leaves": [reviewed(number) for number in range(1, self.pages + 1)]},
            "/api/sessions": lambda: {
                "root": "/srv/planish",
                "sessions": ANSWERS["sessions"] if self.sessions is None else self.sessions,
            },
            "/api/presets": lambda: {"presets": [{"name": name} for name in ("book", "map", "leaflet", "crumpled")]},
            "/api/settings": lambda: {"groups": ANSWERS["settings"]},
            "/api/jobs": lambda: {"jobs": self.jobs},
            "/api/search": lambda: {"hits": [hit], "pages_with_words": self.pages, "pages": self.pages},
        }

    def file(self, path: str) -> Answer | None:
        """A picture, a model or a file of the page; None for none."""
        if found := re.fullmatch(r"/api/pictures/\d+/(?:left\.|right\.)?(\w+)\.dzi", path):
            return deep_zoom(self._layer(found[1])), "application/xml"
        if found := re.fullmatch(r"/api/pictures/\d+/(?:left\.|right\.)?(\w+)_files/(\d+)/(\d+)_(\d+)\.\w+", path):
            return tile(self._layer(found[1]), int(found[2]), int(found[3]), int(found[4]))
        if found := re.fullmatch(r"/api/pictures/\d+/(?:left\.|right\.)?(\w+)/(full|thumbnail\.jpg)", path):
            picture = self._layer(found[1]).copy()
            if found[2] != "full":
                picture.thumbnail((240, 240))
            return encoded(picture.convert("RGB"), "JPEG")
        if path.startswith("/api/preview/"):
            return encoded(on_table(self.sheet), "JPEG") if path.endswith("jpg") else encoded(warned(), "PNG")
        found = re.fullmatch(r"/api/models/\d+/(scan|mesh|steps)", path)
        if found and found[1] not in self.unrecorded:
            return model(found[1], self.points), "application/octet-stream"
        return self._page_file(path)

    def _layer(self, name: str) -> Image.Image:
        if name not in self._layers:
            self._layers[name] = layer(self.sheet, name)
        return self._layers[name]

    def _page_file(self, path: str) -> Answer | None:
        source = self.page / ("index.html" if path == "/" else path.removeprefix("/page/"))
        return (source.read_bytes(), TYPES.get(source.suffix, "application/octet-stream")) if source.is_file() else None
