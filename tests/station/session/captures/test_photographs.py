"""A set of photographs is one capture: stored as it is, restored from the store, restored again to the byte."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import Text, Wave
from oracles.simulation.photographs import Shots, encode_jpeg, photograph_page
from restore import BadInput
from restore.photogrammetry import SCALE_CARD
from station.cli import main
from station.errors import UsageError
from station.session import open_session, scan_path
from station.session.captures.photographs import add_photographs, first_picture, pictures_in
from station.session.derivation.reproduce import reproduce
from station.session.derivation.restoration import run_restore
from station.session.log.steps import record_run
from station.session.terms.parts import RESTORE
from station.session.terms.presets import Preset

PAGE_MM = (160.0, 110.0)
CARD_DPI = 177.8  # seven pixels to a millimetre
SIZE_MM = 0.5  # two sides, each seen to less than a pixel of a quarter of a millimetre
COARSE = {"settings": {"points": 300, "dpi": 50}}


@pytest.fixture
def pictures(tmp_path):
    """Three small pictures of nothing."""
    rng = np.random.default_rng(1)
    folder = tmp_path / "page 7"
    folder.mkdir()
    for name in ("b", "a", "c"):
        (folder / f"{name}.jpg").write_bytes(encode_jpeg(rng.integers(0, 256, (90, 120, 3), np.uint8)))
    return folder


def test_photographs_are_stored_unchanged_as_one_page(volume, pictures):
    with open_session(volume) as writer:
        event = add_photographs(writer, sorted(pictures.iterdir()), scale="148x210")
        stored = scan_path(writer.session, event)
    assert (event.page, event.captured.scale, event.captured.is_photographed) == (1, "148x210", True)
    assert [path.name for path in pictures_in(stored)] == ["a.jpg", "b.jpg", "c.jpg"]
    for path in pictures.iterdir():
        assert (stored / path.name).read_bytes() == path.read_bytes()
    assert event.facts["provenance"]["image_sizes_px"] == {"a.jpg": [120, 90], "b.jpg": [120, 90], "c.jpg": [120, 90]}
    assert first_picture(stored).name == "a.jpg"
    assert Preset().parameters(scale=event.captured.scale)["scale"] == "148x210"
    assert "scale" not in Preset().parameters()


def test_the_command_takes_a_folder_of_them(volume, pictures, tmp_path, capsys):
    index = tmp_path / "index.db"
    assert main(["session", "add", str(volume), "--photos", str(pictures), "--index", str(index)]) == 0
    assert "page 1: 3 photographs" in capsys.readouterr().out
    assert main(["verify", str(volume), "--index", str(index)]) == 0


def test_an_invalid_set_is_not_stored(volume, pictures, tmp_path):
    (pictures / "d.jpg").write_bytes(b"no picture")
    twin = tmp_path / "a.jpg"
    twin.write_bytes((pictures / "a.jpg").read_bytes())
    with open_session(volume) as writer:
        with pytest.raises(BadInput, match=r"d\.jpg"):
            add_photographs(writer, [pictures])
        (tmp_path / "no.obj").write_bytes(b"o\n")
        with pytest.raises(BadInput, match=r"^no\.obj "):  # the copy is none of the operator's
            add_photographs(writer, [tmp_path / "no.obj"])
        with pytest.raises(BadInput, match="have one name"):
            add_photographs(writer, [pictures / "a.jpg", twin])
        with pytest.raises(UsageError, match="--scale"):
            add_photographs(writer, [pictures / "a.jpg"], scale="A4")
        assert [event.kind for event in writer.history.events] == ["session"]


def test_photographs_that_cannot_be_restored_are_a_result(volume, pictures, tmp_path):
    pytest.importorskip("pycolmap")
    run = run_restore(pictures, {**COARSE, "scale": "card"}, tmp_path / "made")
    assert "0 of 3 photographs join" in run.result["error"]
    assert list((tmp_path / "made").iterdir()) == []


@pytest.mark.slow
def test_a_page_of_photographs_is_replayed_to_the_byte(volume, tmp_path):
    pytest.importorskip("pycolmap")
    taken = photograph_page(
        Wave(slope_deg=22.0, wavelength_mm=110.0), Text(sizes_pt=(10.0,), title_pt=16.0, margin_mm=10.0, columns=2),
        views=5, seed=3, card=SCALE_CARD.picture(CARD_DPI), card_dpi=CARD_DPI, shots=Shots(size=(1200, 900)),
        page_mm=PAGE_MM,
    )  # fmt: skip
    (tmp_path / "set").mkdir()
    with open_session(volume) as writer:
        capture = add_photographs(writer, taken.save(tmp_path / "set"))
        parameters = {**COARSE, "scale": capture.facts["scale"]}
        folder = writer.staging("restore")
        run = run_restore(scan_path(writer.session, capture), parameters, folder)
        record_run(writer, RESTORE, capture, parameters=parameters, result=run.result, files=folder, facts=run.facts)
    assert "error" not in run.result, run.result
    np.testing.assert_allclose(run.result["page_mm"], PAGE_MM, atol=SIZE_MM)
    (again,) = reproduce(writer.session, tmp_path / "scratch")
    assert again.differing == ()
