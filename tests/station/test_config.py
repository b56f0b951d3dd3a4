"""The station's configuration: what is read, and that every fault names its key."""

from __future__ import annotations

from pathlib import Path

import pytest

from station.config import load_config
from station.errors import UsageError

SCANNER = '[scanner]\ndriver = "simulated"\n'


def load(tmp_path, text):
    path = tmp_path / "station.toml"
    path.write_text(text, "utf-8")
    return load_config(path)


def test_what_is_left_out_has_a_default(tmp_path):
    config = load(tmp_path, SCANNER)
    assert (config.output.stem, config.restore.points, config.capture.mode) == ("page", 1000, "fine")


def test_what_is_given_is_taken(tmp_path):
    text = SCANNER + 'seed = 4\n[capture]\nmode = "fast"\ngain = 3\n[restore]\ndpi = 300\n[output]\nstem = "Blatt 7"\n'
    config = load(tmp_path, text)
    assert config.scanner == {"driver": "simulated", "seed": 4}
    assert (config.capture.mode, config.capture.gain, config.restore.dpi) == ("fast", 3, 300)
    assert config.output.stem == "Blatt 7"


def test_a_configuration_may_begin_with_a_byte_order_mark(tmp_path, repository):
    path = tmp_path / "station.toml"
    path.write_bytes(b"\xef\xbb\xbf" + (repository / "configs/simulated.toml").read_bytes())
    assert load_config(path).scanner["driver"] == "simulated"


def test_the_demonstration_is_well_formed(repository):
    assert load_config(repository / "configs" / "simulated.toml").scanner["lens"] == "MIDDLE"


@pytest.mark.parametrize("name", ["simulated", "simulated-book", "simulated-turntable", "vivid900"])
def test_a_configuration_that_is_bundled_is_found_by_its_name(name, repository, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    named, given = load_config(Path(name)), load_config(repository / "configs" / f"{name}.toml")
    assert named.model_dump(exclude={"scanner"}) == given.model_dump(exclude={"scanner"})
    assert named.scanner["driver"] == given.scanner["driver"]


def test_a_file_of_that_name_comes_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("simulated").write_text(SCANNER + "seed = 77\n")
    assert load_config(Path("simulated")).scanner["seed"] == 77


def test_the_names_that_are_bundled_are_reported(tmp_path):
    with pytest.raises(UsageError) as caught:
        load_config(tmp_path / "nowhere.toml")
    assert "simulated, simulated-book, simulated-turntable, vivid900" in caught.value.hint


def test_a_configuration_without_its_ending_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(SCANNER)
    with pytest.raises(UsageError, match="the configuration 'mine' does not exist") as caught:
        load_config(Path("mine"))
    assert "the whole name, mine.toml, or a bundled one: program, simulated" in caught.value.hint


def test_a_folder_of_that_name_is_not_a_configuration(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("simulated").mkdir()
    assert load_config(Path("simulated")).scanner["driver"] == "simulated"


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "scanner: is missing"),
        ("[scanner]\n", "driver = None"),
        ('[scanner]\ndriver = "kinect"\n', "driver = 'kinect'"),
        (SCANNER + "[restore]\npoints = -5\n", "restore.points: -5 is not usable"),
        (SCANNER + "[restore]\npionts = 5\n", "restore.pionts: is not a known setting"),
        (SCANNER + "[capture]\ngain = 70\n", "capture.gain = 70 is out of range"),
        (SCANNER + '[capture]\nmode = "slow"\n', "capture.mode: 'slow' is not usable"),
        (SCANNER + "[capture]\nspeed = 1\n", "capture.speed: is not a known setting"),
        (SCANNER + '[output]\nstem = "../page"\n', "output.stem"),
        (SCANNER + '[output]\nstem = ".page"\n', "output.stem"),
        (SCANNER + '[output]\nstem = "a/b"\n', "output.stem"),
        (SCANNER + "[scaner]\n", "scaner: is not a known setting"),
        ("[scanner\n", "is not a TOML file"),
    ],
)
def test_a_fault_names_the_file_and_the_key(tmp_path, text, named):
    with pytest.raises(UsageError) as caught:
        load(tmp_path, text)
    assert named in str(caught.value)
    assert "station.toml" in str(caught.value)


def test_every_mistake_is_reported_and_the_file_once(tmp_path):
    with pytest.raises(UsageError) as caught:
        load(tmp_path, "[restore]\npoints = -5\nsize = 2\n")
    message = str(caught.value)
    assert message.count("station.toml") == 1
    for named in (
        "scanner: is missing; ",
        "restore.points: -5 is not usable",
        "; restore.size: is not a known setting",
    ):
        assert named in message


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(UsageError, match=r"none\.toml"):
        load_config(tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(UsageError, match="is not a TOML file"):
        load_config(tmp_path / "bytes.toml")
