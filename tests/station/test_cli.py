"""The command: exit codes, messages, what is written and what is left alone."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from drivers.scanner import SettingsError, TransportError
from restore.errors import BadInput, NotEnoughSurface
from station.cli import main
from station.storage import disk
from tests.station.conftest import fault

FULL_DISK = Path("/dev/full")


def test_restore_writes_the_page_and_its_report(library, scan_file, tmp_path, capsys):
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out"), "--points", "500", "--dpi", "100"]) == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["book.json", "book.png"]
    assert (library.calls[0].points, library.calls[0].dpi) == (500, 100)
    out, err = capsys.readouterr()
    assert "120.0 × 80.0 mm" in out
    assert str(tmp_path / "out" / "book.png") in out
    assert err == ""  # no progress bars: stderr is not a terminal here


def test_every_output_on_request(library, scan_file, tmp_path):
    kinds = ["--tiff", "--map", "--mesh", "--strain", "--frames", "--review"]
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out"), *kinds]) == 0
    endings = {path.name.removeprefix("book") for path in (tmp_path / "out").iterdir()}
    assert endings == {
        ".png", ".tif", ".json", "-map.tif", "-flat.obj", "-warped.obj", "-mesh.mtl", "-texture.png", "-strain.ply",
        "-strain.png", "-frames.png", "-review.png",
    }  # fmt: skip


def test_json_is_the_report_and_nothing_else(library, scan_file, tmp_path, capsys):
    assert main(["restore", str(scan_file), "-o", str(tmp_path), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((tmp_path / "book.json").read_text())
    wanted = {
        "points",
        "method",
        "dpi",
        "iterations",
        "flipped_faces",
        "area_ratio",
        "strain",
        "page_mm",
        "resolved_ppi",
    }
    assert wanted <= printed.keys()
    assert set(printed["strain"]) >= {"rms", "max"}
    assert len(printed["page_mm"]) == 2
    stages = {"load", "prepare", "decimate", "flatten", "texture", "shade", "total"}
    assert stages <= printed["seconds"].keys()


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--points", "-5"),
        ("--dpi", "0"),
        ("--dpi", "nan"),
        ("--method", "iron"),
        ("--shading", "half"),
        ("--points", "many"),
    ],
)
def test_a_bad_option_is_named(library, scan_file, tmp_path, capsys, option, value):
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out"), option, value]) == 2
    assert option in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "arguments", [["restore"], ["restore", "scan.obj"], ["scan", "-o", "out"], ["press"], ["--flat"]]
)
def test_a_command_that_cannot_be_is_refused(arguments, capsys):
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "--help" in fault(err)[1]
    assert len(fault(err)) == 2


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (BadInput("book.abs.gz is damaged", "copy it again"), 3),
        (NotEnoughSurface("the scan shows no page", "lay one under the scanner"), 5),
        (OSError(errno.ENOSPC, "No space left on device"), 6),
        (MemoryError(), 1),
        (KeyboardInterrupt(), 130),
    ],
)
def test_a_fault_of_the_restoration(library, scan_file, tmp_path, capsys, error, code):
    library.fault = error
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out")]) == code
    message, *hints = fault(capsys.readouterr().err)
    assert message
    assert hints
    assert not (tmp_path / "out").exists()


def test_what_the_library_says_is_reported_word_for_word(library, scan_file, tmp_path, capsys):
    library.load_fault = BadInput("book.abs.gz is damaged", "copy it again")
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out")]) == 3
    assert fault(capsys.readouterr().err) == ["book.abs.gz is damaged", "copy it again"]
    assert not (tmp_path / "out").exists()


def test_an_unexpected_fault_is_one_line_unless_debugging(library, scan_file, tmp_path, capsys):
    library.fault = ZeroDivisionError("float division by zero\nand a second line")
    command = ["restore", str(scan_file), "-o", str(tmp_path / "out")]
    assert main(command) == 1
    message, hint = fault(capsys.readouterr().err)
    assert message == "unexpected fault: ZeroDivisionError: float division by zero"
    assert "--debug" in hint
    assert main([*command, "--debug"]) == 1
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("number", "remedy"),
    [(errno.ENOSPC, "free some space"), (errno.EROFS, "read-only"), (errno.EACCES, "may not write")],
)
def test_a_disk_that_refuses(library, scan_file, tmp_path, capsys, monkeypatch, number, remedy):
    written = []

    def write(file, data):
        written.append(data)
        if len(written) == 2:  # the page, then the report
            file.write(data[: len(data) // 2])
            raise OSError(number, os.strerror(number), file.name)

    monkeypatch.setattr(disk, "write_and_sync", write)
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out")]) == 6
    message, hint = fault(capsys.readouterr().err)
    assert os.strerror(number) in message
    assert remedy in hint
    assert not (tmp_path / "out").exists()


def test_an_output_folder_that_is_a_file(library, scan_file, tmp_path, capsys):
    (tmp_path / "out").write_text("not a folder")
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out")]) == 6
    assert "is a file" in fault(capsys.readouterr().err)[1]
    assert library.calls == []


def test_nothing_is_overwritten_without_force(library, scan_file, tmp_path, capsys):
    command = ["restore", str(scan_file), "-o", str(tmp_path / "out")]
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "book.png").write_bytes(b"mine")
    assert main(command) == 2
    message, hint = fault(capsys.readouterr().err)
    assert "book.png" in message
    assert "--force" in hint
    assert library.calls == []  # refused before the work
    assert (tmp_path / "out" / "book.png").read_bytes() == b"mine"
    assert main([*command, "--force"]) == 0
    assert (tmp_path / "out" / "book.png").read_bytes().startswith(b"\x89PNG")


def test_scan_stores_what_it_captured_and_reviews_it(library, scanner, config_file, tmp_path):
    assert main(["scan", "--config", str(config_file), "-o", str(tmp_path / "out")]) == 0
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["page-review.png", "page.json", "page.png", "page.scan"]
    assert scanner.closed == 1


def test_a_fault_after_the_capture_keeps_the_scan(library, scanner, config_file, tmp_path, capsys):
    library.fault = NotEnoughSurface("the scan shows no page", "lay one under the scanner")
    assert main(["scan", "--config", str(config_file), "-o", str(tmp_path / "out")]) == 5
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["page.scan"]
    *_, advice = fault(capsys.readouterr().err)
    assert f"planish restore {tmp_path / 'out' / 'page.scan'}" in advice
    library.fault = None
    assert main(["restore", str(tmp_path / "out" / "page.scan"), "-o", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "page.png").exists()


@pytest.mark.parametrize(
    ("error", "code"),
    [(TransportError("the cable is out", "plug it in"), 4), (KeyboardInterrupt(), 130), (SystemError("bad"), 1)],
)
def test_a_fault_of_the_scanner_lets_it_go(library, scanner, config_file, tmp_path, capsys, error, code):
    scanner.fault = error
    assert main(["scan", "--config", str(config_file), "-o", str(tmp_path / "out")]) == code
    fault(capsys.readouterr().err)
    assert scanner.closed == 1
    assert not (tmp_path / "out").exists()


def test_a_setting_that_the_driver_refuses(library, config_file, tmp_path, capsys, monkeypatch):
    def refuse(_config):
        raise SettingsError("scanner.lens: there is no 'FISHEYE'", "use one of: MIDDLE, TELE, WIDE")

    monkeypatch.setattr("station.run.one_page.drivers.open_scanner", refuse)
    assert main(["scan", "--config", str(config_file), "-o", str(tmp_path / "out")]) == 2
    assert "scanner.lens" in capsys.readouterr().err


def test_termination_lets_the_scanner_go(library, scanner, config_file, tmp_path, capsys, monkeypatch):
    before = signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr(scanner, "capture", lambda *_: os.kill(os.getpid(), signal.SIGTERM))
    assert main(["scan", "--config", str(config_file), "-o", str(tmp_path / "out")]) == 128 + signal.SIGTERM
    assert fault(capsys.readouterr().err)[0] == "stopped by SIGTERM"
    assert scanner.closed == 1
    assert signal.getsignal(signal.SIGTERM) is before


def test_help_names_the_defaults_of_the_library(capsys):
    from restore import Settings

    main(["restore", "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    defaults = Settings()
    for default in (defaults.points, defaults.dpi, defaults.method, defaults.shading):
        assert (
            f"[default: ({default:g})]" in shown if isinstance(default, float) else f"[default: ({default})]" in shown
        )


def run(*arguments: object, **options) -> subprocess.CompletedProcess[str]:
    """The command as a process of its own."""
    command = [sys.executable, "-m", "station", *map(str, arguments)]
    return subprocess.run(command, stderr=subprocess.PIPE, text=True, **options)


def test_as_a_process_version(repository):
    done = run("--version", cwd=repository, stdout=subprocess.PIPE)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("planish")


def test_as_a_process_a_missing_scan(repository, tmp_path):
    done = run("restore", tmp_path / "none.obj", "-o", tmp_path / "out", cwd=repository, stdout=subprocess.PIPE)
    assert (done.returncode, done.stdout) == (3, "")
    assert "none.obj" in fault(done.stderr)[0]
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(not FULL_DISK.exists(), reason="this system has no /dev/full")
def test_as_a_process_a_full_disk_under_stdout(repository):
    with FULL_DISK.open("w") as full:
        done = run("--version", cwd=repository, stdout=full)
    assert done.returncode == 6
    assert fault(done.stderr)[1].startswith("free some space")


def test_as_a_process_a_closed_stdout_is_not_an_error(repository):
    done = run("--version", cwd=repository, preexec_fn=lambda: os.close(1))
    assert (done.returncode, done.stderr) == (0, "")


def picture_file(path: Path) -> Path:
    from PIL import Image

    Image.linear_gradient("L").convert("RGB").save(path)
    return path


def test_photographs_go_to_the_restoration_in_their_order(library, scan_file, tmp_path):
    photos = [picture_file(tmp_path / name) for name in ("window.jpg", "lamp.png")]
    command = ["restore", str(scan_file), "-o", str(tmp_path / "out")]
    assert main([*command, "--photo", str(photos[0]), "--photo", str(photos[1])]) == 0
    assert [photo.name for photo in library.photos] == ["window.jpg", "lamp.png"]
    assert all(photo.image.shape == (256, 256, 3) for photo in library.photos)


def test_a_photograph_that_was_cut_short_ends_the_run_before_the_work(library, scan_file, tmp_path, capsys):
    photo = picture_file(tmp_path / "window.jpg")
    photo.write_bytes(photo.read_bytes()[:400])
    command = ["restore", str(scan_file), "-o", str(tmp_path / "out"), "--photo", str(photo)]
    assert main(command) == 3
    message, hint = fault(capsys.readouterr().err)
    assert "window.jpg" in message
    assert "copy it again" in hint
    assert library.calls == []
    assert not (tmp_path / "out").exists()


def test_a_photograph_is_never_overwritten(library, scan_file, tmp_path, capsys):
    (tmp_path / "out").mkdir()
    photo = picture_file(tmp_path / "out" / "book.png")
    before = photo.read_bytes()
    command = ["restore", str(scan_file), "-o", str(tmp_path / "out"), "--photo", str(photo), "--force"]
    assert main(command) == 2
    assert "original" in fault(capsys.readouterr().err)[0]
    assert photo.read_bytes() == before


def test_a_setting_is_called_by_its_option(library, scan_file, tmp_path, capsys):
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out"), "--inpaint", "-3"]) == 2
    assert fault(capsys.readouterr().err)[0].startswith("--inpaint: ")


@pytest.mark.parametrize("name", ["", " "])
@pytest.mark.parametrize("command", [["restore", "SCAN"], ["ocr", "SCAN"], ["colour", "SCAN"], ["board"]])
def test_an_empty_name_of_an_output_is_refused(library, scan_file, tmp_path, capsys, monkeypatch, command, name):
    monkeypatch.chdir(tmp_path)
    assert main([*(word.replace("SCAN", str(scan_file)) for word in command), "-o", name]) == 2
    assert "the name is empty" in fault(capsys.readouterr().err)[0]
    assert [path.name for path in tmp_path.iterdir()] == ["scans"]


@pytest.mark.parametrize("value", ['["a"]', "3", "{}"])
def test_a_driver_of_another_type_is_named(config_file, tmp_path, capsys, value):
    config_file.write_text(f"[scanner]\ndriver = {value}\n")
    assert main(["scan", "--config", str(config_file), "-o", str(tmp_path / "out")]) == 2
    assert "is not known" in fault(capsys.readouterr().err)[0]


@pytest.mark.parametrize("text", ["x = " + "[" * 500, "x = " + "[" * 500 + "]" * 500, ".".join("a" * 400) + " = 1"])
def test_a_configuration_nested_deeply_is_refused(tmp_path, capsys, text):
    (tmp_path / "station.toml").write_text(text)
    assert main(["scan", "--config", str(tmp_path / "station.toml"), "-o", str(tmp_path / "out")]) == 2
    assert "station.toml" in fault(capsys.readouterr().err)[0]


def test_a_full_disk_is_named_by_its_folder(library, scan_file, tmp_path, capsys, monkeypatch):
    def write(file, _data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), file.name)

    monkeypatch.setattr(disk, "write_and_sync", write)
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out")]) == 6
    message, hint = fault(capsys.readouterr().err)
    assert str(tmp_path / "out" / "book.png") in message
    assert "on the disk at /" in hint


def test_without_arguments_the_help_is_printed(capsys):
    assert main([]) == 2
    assert "restore" in capsys.readouterr().out


def test_as_a_process_stdout_may_be_closed(repository, tmp_path):
    for argument in ("--version", "--help"):
        reading, writing = os.pipe()
        os.close(reading)
        done = run(argument, cwd=repository, stdout=writing)
        os.close(writing)
        assert (done.returncode, done.stderr) == (128 + signal.SIGPIPE, "")


@pytest.mark.parametrize("option", ["--points", "--debug"])
def test_as_a_process_a_closed_stderr_keeps_the_exit_code(repository, tmp_path, option):
    """Neither a fault nor a usage error is printed on stdout instead."""
    words = ["restore", str(tmp_path / "none.obj"), "-o", str(tmp_path / "out"), option]
    done = run(*words, cwd=repository, stdout=subprocess.PIPE, preexec_fn=lambda: os.close(2))
    assert (done.returncode, done.stdout) == (2 if option == "--points" else 3, "")


def test_a_command_that_restores_nothing_does_not_wait_for_the_library():
    code = "import sys; from station.cli import main; main(['session', '--help']); sys.exit('restore' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode == 0
