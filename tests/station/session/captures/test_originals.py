"""Scans of others: every file of a scan, unchanged, under the names by which they refer to each other."""

from __future__ import annotations

import errno

import numpy as np
import pytest

from oracles import clouds
from restore import BadInput, load_scan, save_scan
from station.errors import explain
from station.images.png import encode_png
from station.run.small_page import small_page
from station.session import open_session, scan_path
from station.session.captures.originals import add_original, add_originals, gather
from station.session.derivation.parameters import parameters_of
from tests.restore.formats.conftest import MIDDLE_PX, make_shot

OBJ = """mtllib Sheet.MTL
v 0 0 0\nv 9 0 0\nv 0 9 0\nv 9 9 1
vt 0 0\nvt 1 0\nvt 0 1\nvt 1 1
f 1/1 2/2 3/3\nf 2/2 4/4 3/3
"""


@pytest.fixture
def mesh(tmp_path):
    """A mesh with its material and picture, in a folder with a file of no concern."""
    folder = tmp_path / "export"
    (folder / "maps").mkdir(parents=True)
    (folder / "sheet.obj").write_text(OBJ)
    (folder / "sheet.mtl").write_text("newmtl m\nmap_Kd maps/colour.png\n")
    (folder / "maps/colour.png").write_bytes(encode_png(np.zeros((4, 4, 3), np.uint8), 100.0))
    (folder / "other.txt").write_text("x")
    return folder / "sheet.obj"


def test_a_mesh_with_its_material_and_picture(volume, mesh):
    assert sorted(gather(mesh).files) == ["Sheet.MTL", "maps/colour.png", "sheet.obj"]
    with open_session(volume) as writer:
        event = add_original(writer, mesh, unit="mm")
        stored = scan_path(writer.session, event)
    assert (event.page, event.facts["unit"], event.facts["from"]) == (1, "mm", str(mesh))
    for name, path in gather(mesh).files.items():
        assert (stored.parent / name).read_bytes() == path.read_bytes()
    assert load_scan(stored).texture.shape == (4, 4, 3)


def test_how_a_cloud_is_read_goes_with_it(volume, tmp_path):
    shot = make_shot(24, 32, whole=True)
    clouds.write_ply(tmp_path / "a.ply", shot)
    clouds.write_depth(tmp_path / "depth", shot, MIDDLE_PX, kind="float", length=True)
    with open_session(volume) as writer:
        cloud = add_original(writer, tmp_path / "a.ply", unit="auto", grid="32x24", depth="auto")
        image = add_original(writer, tmp_path / "depth", depth="ray")
        parameters = [parameters_of(writer.session, page) for page in writer.session.history.pages()]
    assert [cloud.facts.get(name) for name in ("unit", "grid", "depth")] == ["auto", "32x24", None]
    assert image.facts["depth"] == "ray"
    assert [one.get("grid") for one in parameters] == ["32x24", None]
    assert [one.get("depth") for one in parameters] == [None, "ray"]


def test_a_scan_folder(volume, tmp_path):
    save_scan(small_page(), tmp_path / "a.scan")
    with open_session(volume) as writer:
        event = add_original(writer, tmp_path / "a.scan", page=7)
        assert np.array_equal(load_scan(scan_path(writer.session, event)).points, small_page().points)
    assert event.page == 7


@pytest.mark.parametrize("content", [b"", b"v 0 0\nf 1 2 3\n"])
def test_an_unreadable_file_is_not_a_page(volume, tmp_path, content):
    (tmp_path / "bad.obj").write_bytes(content)
    with open_session(volume) as writer:
        with pytest.raises(BadInput) as caught:
            add_original(writer, tmp_path / "bad.obj")
        assert str(volume) not in str(caught.value)  # the copy there is none of the operator's
        assert len(writer.history.events) == 1


def test_of_several_files_all_are_added_or_none(volume, mesh, tmp_path):
    (tmp_path / "bad.obj").write_text("v 0 0\nf 1 2 3\n")
    with open_session(volume) as writer:
        with pytest.raises(BadInput, match=r"bad\.obj"):
            add_originals(writer, [mesh, tmp_path / "bad.obj", mesh])
        assert len(writer.history.events) == 1
        assert not list(writer.staging("x").parent.iterdir())  # no copy is left
        events = add_originals(writer, [mesh, mesh])
        assert [event.page for event in events] == [1, 2]
        assert [load_scan(scan_path(writer.session, event)).texture.shape for event in events] == [(4, 4, 3)] * 2


def test_a_copy_that_the_disk_does_not_give_back_is_a_fault_of_the_disk(volume, mesh, monkeypatch):
    def unreadable(path, **reading):
        raise BadInput(f"{path} cannot be read") from OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr("station.session.captures.originals.load_scan", unreadable)
    with open_session(volume) as writer, pytest.raises(OSError, match="Input/output") as raised:
        add_original(writer, mesh)
    assert explain(raised.value).exit_code == 6


def test_a_disk_that_refuses_the_copy_is_named_by_the_session(volume, mesh, small_files):
    with mesh.open("a") as file:
        file.write("# long\n" * 1000)
    with open_session(volume) as writer, small_files, pytest.raises(OSError, match="too large") as raised:
        add_original(writer, mesh)
    assert raised.value.filename == str(volume / "sheet.obj")


def test_a_file_that_is_not_there(tmp_path):
    for name in ("gone.obj", "gone.scan"):
        with pytest.raises(BadInput, match=f"{name} does not exist"):
            gather(tmp_path / name)
