"""A session whose files somebody changed, through the whole interface: a reason for each, no fault of the server."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from PIL import Image

from station.archive.formats import Format
from station.console import work
from station.images.tiff import encode_uncertainty
from station.page_files.model import encode_arrays
from station.session import Event, Volume, add_scan, create_session, open_session, read_session
from station.session.log import bag, reading
from station.session.log.events import RECORD
from station.session.log.steps import decide, record_run
from station.verdict.packed import PACKED_BYTES, pack
from tests.station.conftest import curl_scan
from tests.station.console.conftest import GatedScanner, StandInRestorer, serving

SHORT, PORTION, PORTIONS = 10, 100, 2  # mutations; portions, each of its own seed; 20 of them passed
MEMORY_BYTES = 2**30
JUNK: tuple[Any, ...] = (
    None,
    True,
    -1,
    0,
    10**30,
    1e308,
    "",
    "x" * 5000,
    "../..",
    "\x1b[2J",
    [],
    {},
    [[]],
    {"a": []},
    "NaN",
)
EXPECTED = {"station_error", "restore_error", "os_error"}  # of the session or the disk, none of the program
READ = (
    "/api/state", "/api/pages", "/api/pages/1", "/api/pages/1/words", "/api/pages/1/edits", "/api/search?q=a",
    "/api/settings", "/api/sessions", "/api/pictures/3/page.dzi", "/api/pictures/3/page/full",
    "/api/pictures/3/page/thumbnail.jpg",
    "/api/pictures/3/coverage.dzi", "/api/pictures/3/coverage/legend", "/api/pictures/3/strain.dzi",
    "/api/pictures/3/strain_files/6/0_0.png", "/api/pictures/3/strain/scale", "/api/pictures/3/strain/full",
    "/api/pictures/3/uncertainty/full", "/api/pictures/3/uncertainty/scale",
    "/api/pictures/2/original.dzi", "/api/models/2/scan", "/api/models/3/mesh", "/api/models/3/steps",
    "/api/models/3/measure?x0=1&y0=1&x1=9&y1=5",
)  # fmt: skip


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session with a page that has every kind of file."""
    folder = tmp_path_factory.mktemp("fuzz") / "volume"
    create_session(folder, Volume(title="A volume"))
    with open_session(folder) as writer:
        capture = add_scan(writer, curl_scan(), facts={"by": "a test"})
        made = writer.staging("run")
        made.mkdir()
        Image.fromarray(np.full((60, 80, 3), 200, np.uint8)).save(made / "page.png", dpi=(150, 150))
        Image.fromarray(np.ones((60, 80), np.uint8)).save(made / "page-coverage.png")
        (made / "page-uncertainty.tif").write_bytes(encode_uncertainty(np.ones((60, 80), np.float32), 150))
        x, y = np.meshgrid(np.linspace(-10, 10, 5), np.linspace(-5, 5, 4))
        flat = np.stack([x.ravel(), y.ravel()], 1)
        corner = np.array([r * 5 + c for r in range(3) for c in range(4)])[:, None]
        faces = np.concatenate([corner + [0, 1, 6], corner + [0, 6, 5]])
        arrays = {"vertices": np.column_stack([flat, flat[:, 0] ** 2]), "flat": flat, "faces": faces,
                  "strain": flat[:, 0] / 1e3, "page_uv": flat / [20, 10] + 0.5}  # fmt: skip
        (made / "page-model.plm").write_bytes(encode_arrays(arrays, {"dpi": 150.0}))
        (made / "page-alto.xml").write_bytes(
            b'<alto xmlns="http://www.loc.gov/standards/alto/ns-v4#"><TextLine>'
            b'<String CONTENT="a" HPOS="1" VPOS="2" WIDTH="3" HEIGHT="4"/></TextLine></alto>'
        )
        measures = {"fingerprint": pack(bytes(PACKED_BYTES)), "blur_px": 1.0}
        result = {"page_mm": [20.0, 10.0], "dpi": 150.0, "method": "isometric", "measures": measures}
        run = record_run(writer, "restore", capture, parameters={}, result=result, files=made)
        check = {"name": "blur_px", "level": "green", "value": 1.0, "limits": [1.5, 2.5], "text": "a", "hint": "b"}
        record_run(writer, "verdict", run, parameters={}, result={"level": "green", "checks": [check]})
        decide(writer, "label", "1r", page=1)
        decide(writer, "settings", {"settings": {"dpi": 200}})
    return folder


def change_bytes(folder: Path, chance: random.Random) -> None:
    """Change, cut short, double, empty or remove a file, or put something else in its place."""
    path = chance.choice(sorted(file for file in folder.rglob("*") if file.is_file()))
    data = bytearray(path.read_bytes())
    kind = chance.randrange(8)
    path.chmod(0o600)
    if kind < 4:
        for _ in range(chance.choice((1, 3, 30))):
            data[chance.randrange(len(data))] = chance.randrange(256)
        path.write_bytes(data)
    elif kind == 4:
        path.write_bytes(data[: chance.randrange(len(data))])
    elif kind == 5:
        path.write_bytes(data + data)
    elif kind == 6:
        path.unlink()
    else:
        path.unlink()
        chance.choice((path.mkdir, lambda: path.symlink_to("/etc/passwd"), lambda: path.symlink_to(path.name)))()


def change_facts(folder: Path, chance: random.Random) -> None:
    """Replace a value in the facts of an event, with files that agree with each other."""
    events = list(reading.read_stored(folder).events)
    at = chance.randrange(len(events))
    facts = _changed(dict(events[at].facts), chance)
    fields: dict[str, Any] = {"facts": facts if isinstance(facts, dict) else {}}
    if chance.random() < 0.2:
        fields[chance.choice(("slot", "time"))] = chance.choice(("label", "restore@2", "capture", "1970-01-01", "x"))
    events[at] = replace(events[at], **fields)
    _write(folder, events)


def _changed(value: Any, chance: random.Random) -> Any:
    if isinstance(value, dict) and value and chance.random() < 0.8:
        key = chance.choice(sorted(value))
        if chance.random() < 0.15:
            return {name: one for name, one in value.items() if name != key}
        return {**value, key: _changed(value[key], chance)}
    if isinstance(value, list) and value and chance.random() < 0.6:
        at = chance.randrange(len(value))
        return [*value[:at], _changed(value[at], chance), *value[at + 1 :]]
    return chance.choice(JUNK)


def _write(folder: Path, events: list[Event]) -> None:
    lines = [event.line for event in events]
    for event, line in zip(events, lines, strict=True):
        place = folder / bag.PAYLOAD / event.folder
        place.mkdir(exist_ok=True)
        (place / RECORD).unlink(missing_ok=True)
        (place / RECORD).write_bytes(line)
    for name, data in bag.tag_files(events).items():
        (folder / name).write_bytes(data)


CHANGES: tuple[Callable[[Path, random.Random], None], ...] = (change_bytes, change_facts)


@pytest.mark.parametrize(
    ("count", "seed"),
    [(SHORT, 10), *(pytest.param(PORTION, seed, marks=pytest.mark.slow) for seed in range(PORTIONS))],
)
def test_a_changed_session_is_not_an_error_of_the_server(whole, tmp_path, count, seed) -> None:
    """It is opened, looked at, verified and exported, by the same calls as the jobs of the server."""
    chance = random.Random(seed)
    before = psutil.Process().memory_info().rss
    with serving(tmp_path, GatedScanner(curl_scan()), StandInRestorer()) as served, served.client() as browser:
        for number in range(count):
            folder = tmp_path / "volume"
            shutil.copytree(whole, folder, symlinks=True)
            chance.choice(CHANGES)(folder, chance)
            opened = browser.post("/api/sessions/volume/open", json={"read_only": chance.random() < 0.7})
            statuses = {"open": opened.status_code}
            statuses |= {path: browser.get(path).status_code for path in READ}
            if opened.status_code == 200:
                statuses["close"] = browser.post("/api/close").status_code
            for task in ({"kind": "verify"}, {"kind": "export", "format": chance.choice(list(Format)).value}):
                told = list[dict[str, Any]]()
                work.run({**task, "session": str(folder), "out": str(tmp_path / "exports" / "volume")}, told.append)
                reported = EXPECTED & {*told[-1].get("error", {"kinds": EXPECTED})["kinds"]}
                statuses[task["kind"]] = 200 if reported else 500
            wrong = {path: status for path, status in statuses.items() if status >= 500}
            assert not wrong, (number, wrong, opened.text, told[-1])
            assert browser.get("/api/state").json()["session"] is None
            shutil.rmtree(folder)
            shutil.rmtree(tmp_path / "exports", ignore_errors=True)
        assert psutil.Process().memory_info().rss - before < MEMORY_BYTES
    assert len(read_session(whole).history.events) == 6
