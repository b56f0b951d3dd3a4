"""Recording and replay: the file, damaged files, and a replay that is asked something else."""

from __future__ import annotations

import io
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.scanner import TransportError
from drivers.scsi.in_process import InProcess
from drivers.scsi.replay import Exchange, Head, Recorder, Replay, load_replay
from drivers.scsi.transport import GOOD, Reply

BYTES = st.binary(max_size=40)
ANSWERED = st.builds(
    Exchange, cdb=BYTES, out=BYTES, asked=st.integers(40, 99), status=st.integers(0, 255), data=BYTES, sense=BYTES
)
FAILED = st.builds(Exchange, cdb=BYTES, out=BYTES, asked=st.integers(0, 99), failure=st.text(), hint=st.text())


@pytest.fixture
def recording(device) -> str:
    file = io.StringIO()
    recorder = Recorder(InProcess(device), file)
    recorder.execute(*device.reading(4))
    recorder.execute(bytes([device.WRITE] + 5 * [0]), b"parameters")
    return file.getvalue()


@given(st.one_of(ANSWERED, FAILED))
def test_exchanges_survive_the_file(exchange):
    line = exchange.model_dump_json(by_alias=True, exclude_defaults=True)
    assert "\n" not in line
    assert Exchange.model_validate_json(line) == exchange


def test_the_file_as_documented(recording):
    head, first, second = map(json.loads, recording.splitlines())
    assert head == {"format": "planish-scsi-recording", "version": 1, "max_transfer": 1 << 20}
    assert first == {"cdb": "wgAAAAAA", "in": 4, "status": GOOD, "data": "AAECAw=="}
    assert second == {"cdb": "wQAAAAAA", "out": "cGFyYW1ldGVycw==", "status": GOOD}


def test_what_was_said_is_in_the_file_at_once(device, tmp_path):
    with (tmp_path / "talk.jsonl").open("w") as file:
        Recorder(InProcess(device), file).execute(*device.reading(4))
        assert (tmp_path / "talk.jsonl").read_text().count("\n") == 2


@pytest.mark.parametrize("change", ["cdb", "data_out", "length", "order", "more"])
def test_a_replay_that_is_asked_something_else_refuses(device, recording, change):
    replay = Replay(recording.splitlines())
    write = (bytes([device.WRITE] + 5 * [0]), b"parameters")
    asked = {
        "cdb": [(bytes([device.READ, 0, 0, 0, 1, 0]), b"", 4)],
        "data_out": [device.reading(4), (write[0], b"parameterS")],
        "length": [device.reading(5)],
        "order": [write],
        "more": [device.reading(4), write, write],
    }[change]
    *before, last = asked
    for command in before:
        replay.execute(*command)
    with pytest.raises(TransportError, match="the recording"):
        replay.execute(*last)


def test_a_replay_goes_on_after_a_refusal(device, recording):
    replay = Replay(recording.splitlines())
    with pytest.raises(TransportError):
        replay.execute(*device.reading(5))
    assert replay.execute(*device.reading(4)) == Reply(GOOD, bytes(range(4)))


def test_faults_of_the_way_are_recorded_and_happen_again():
    class Broken:
        max_transfer = 512

        def execute(self, *_arguments):
            raise TransportError("the cable is out\nof its socket", "put it in")

    file = io.StringIO()
    for transport in (Recorder(Broken(), file), None):
        with pytest.raises(TransportError, match="cable") as caught:
            (transport or Replay(file.getvalue().splitlines())).execute(bytes(6))
        assert caught.value.hint == "put it in"


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: "",
        lambda text: "\n" + text,
        lambda text: text.replace("recording", "music"),
        lambda text: text.replace('"version":1', '"version":2'),
        lambda text: text.replace("AAECAw==", "!!!"),
        lambda text: text.replace("AAECAw==", "AAECAwQFBgc="),
        lambda text: text.replace('"status":0', '"status":256'),
        lambda text: text.replace('"status":0', '"status":0,"failure":"both"'),
        lambda text: text.replace('"status":0', '"state":0'),
    ],
)
def test_damaged_recordings_are_declared(tmp_path, recording, spoil):
    path = tmp_path / "talk.jsonl"
    path.write_text(spoil(recording))
    with pytest.raises(TransportError, match=r"talk\.jsonl") as caught:
        load_replay(path)
    assert caught.value.hint


@given(st.lists(st.text(max_size=60), max_size=3))
def test_any_lines_are_a_recording_or_the_declared_error(lines):
    head = Head(max_transfer=8).model_dump_json()
    for content in (lines, [head, *lines]):
        try:
            Replay(content)
        except TransportError:
            continue
        assert content == [head]


def test_files_that_cannot_be_read_are_declared(tmp_path):
    with pytest.raises(TransportError, match="nothing"):
        load_replay(tmp_path / "nothing")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe")
    with pytest.raises(TransportError, match="bytes"):
        load_replay(tmp_path / "bytes")


def test_a_recording_is_replayed_from_its_file(tmp_path, device, recording):
    (tmp_path / "talk.jsonl").write_text(recording)
    replay = load_replay(tmp_path / "talk.jsonl")
    assert replay.max_transfer == 1 << 20
    assert replay.execute(*device.reading(4)) == Reply(GOOD, bytes(range(4)))


@pytest.mark.parametrize("bytes_lost", [1, 10])
def test_a_recording_that_was_cut_off_is_replayed_up_to_its_last_whole_line(tmp_path, device, recording, bytes_lost):
    (tmp_path / "talk.jsonl").write_text(recording[:-bytes_lost])
    replay = load_replay(tmp_path / "talk.jsonl")
    replay.execute(*device.reading(4))
    with pytest.raises(TransportError, match="ends after 1 command"):
        replay.execute(bytes([device.WRITE] + 5 * [0]), b"parameters")


class FullDisk(io.StringIO):
    """A file on a disk with room for so many characters."""

    room = 1 << 30

    def write(self, text: str) -> int:
        if self.tell() + len(text) > self.room:
            super().write(text[: self.room - self.tell()])
            raise OSError(28, "No space left on device")
        return super().write(text)


def test_commands_go_on_when_the_disk_is_full(device, caplog):
    file = FullDisk()
    recorder = Recorder(InProcess(device), file)
    file.room = file.tell() + 10
    for _ in range(3):
        assert recorder.execute(*device.reading(4)) == Reply(GOOD, bytes(range(4)))
    assert [record.getMessage() for record in caplog.records] == [
        "the recording ends here, the capture goes on: [Errno 28] No space left on device"
    ]
    recorder.close()


def test_a_reply_that_cannot_be_recorded_is_a_reply(caplog):
    class Chatty:
        max_transfer = 512

        def execute(self, *_arguments):
            return Reply(GOOD, b"more than was asked for")

    assert Recorder(Chatty(), io.StringIO()).execute(bytes(6)).data == b"more than was asked for"
    assert "recording ends" in caplog.text
