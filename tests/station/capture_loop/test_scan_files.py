"""A shift at a scanner that is a program: files are stored as they came, faults reported."""

from __future__ import annotations

from concurrent.futures import Future
from pathlib import Path

import pytest

from drivers import open_scanner, settings_of
from restore import load_scan
from station.capture_loop.loop import CaptureLoop
from station.session import Volume, create_session, open_session, read_session, scan_path
from station.session.derivation.restoration import Run
from station.session.fixity.verify import verify
from station.session.terms.presets import load_preset
from tests.drivers.program.conftest import MESH

PICTURE = b"P6 2 2 255\n" + bytes(12)
SCRIPT = f"""
import os, pathlib, sys
folder = pathlib.Path(sys.argv[0]).parent
place, fault = pathlib.Path(sys.argv[1]), (folder / "fault").read_text()
mesh = {MESH!r}
if fault == "killed":
    os.kill(os.getpid(), 9)
if fault == "sentence":
    sys.exit("the lamp is cold")
if fault == "disk full":
    raise OSError(28, "No space left on device")
if fault == "nothing":
    sys.exit()
place.write_text({{"half": mesh[:40], "wrong format": "<html></html>"}}.get(fault, "mtllib page.mtl\\n" + mesh))
(place.parent / "page.mtl").write_text("newmtl page\\nmap_Kd page.ppm\\n")
(place.parent / "page.ppm").write_bytes({PICTURE!r})
"""
SAID = {
    "killed": "was ended by signal 9",
    "sentence": "ended with code 1: the lamp is cold",
    "disk full": "No space left on device",
    "nothing": "the program wrote no shot.obj",
    "half": "the file is kept: ",
    "wrong format": "the file is kept: ",
}


@pytest.fixture
def shift(tmp_path, monkeypatch):
    """A loop before such a scanner, its lines, its folder; the session is verified at the end."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "shots"))
    (tmp_path / "shots").mkdir()
    (tmp_path / "grab.py").write_text(SCRIPT)
    settings = load_preset("leaflet").model_dump(mode="json", exclude_none=True)
    create_session(tmp_path / "book", Volume(title="A book", preset_values=settings))
    command = ["{python}", str(tmp_path / "grab.py"), "{output}"]
    table = {"driver": "program", "capture": command, "output": "shot.obj", "settle_s": 0, "unit": "mm"}
    lines: list[str] = []

    def submit(source: Path, _parameters: object, folder: Path) -> Future[Run]:
        future: Future[Run] = Future()
        load_scan(source)
        folder.mkdir()
        future.set_result(Run({"error": "not restored here", "hint": ""}))
        return future

    with open_session(tmp_path / "book") as writer, open_scanner(table) as scanner:
        settings = settings_of(table)()
        yield (
            CaptureLoop(writer, lambda: scanner.capture(settings), submit, lambda message: lines.append(message.text)),
            lines,
            tmp_path,
        )
    assert verify(tmp_path / "book").problems == ()


def press(shift, fault: str, action: str = "capture") -> str:
    loop, lines, place = shift
    (place / "fault").write_text(fault)
    before = len(lines)
    loop.press(action)
    return lines[before]


def test_a_file_is_stored_as_it_came_with_what_it_names(shift):
    assert press(shift, "") == "page 1 [1r]: stored"
    session = read_session(shift[2] / "book")
    (page,) = session.history.pages()
    path = scan_path(session, page.capture)
    assert path.read_text() == "mtllib page.mtl\n" + MESH
    assert (path.parent / "page.ppm").read_bytes() == PICTURE
    facts = page.capture.facts
    assert (facts["by"], facts["unit"], facts["provenance"]["device"]) == ("planish capture", "mm", "grab")
    assert list((shift[2] / "shots").iterdir()) == []


@pytest.mark.parametrize("fault", SAID)
def test_a_fault_is_said_in_words_nothing_is_lost_and_the_loop_goes_on(shift, fault):
    press(shift, "")
    line = press(shift, fault)
    assert line.startswith("not captured: ")
    assert SAID[fault] in line
    if "the file is kept" in line:
        assert Path(line.partition("the file is kept: ")[2].removesuffix(")")).is_file()
    assert press(shift, "", "again") == "page 1 [1r]: stored"
    assert press(shift, "") == "page 2 [1v]: stored"
    session = read_session(shift[2] / "book")
    assert [page.number for page in session.history.pages()] == [1, 2]
