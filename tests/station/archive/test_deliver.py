"""Every format of delivery: whole and valid, or not there; what the volume lacks is named."""

from __future__ import annotations

import dataclasses
import json
import subprocess

import numpy as np
import pytest

from restore import BadInput, RangeScan, load_scan
from station.archive import deliver as delivery
from station.archive.deliver import deliver
from station.archive.formats import Format
from station.archive.volume import Role, missing
from station.errors import OverwriteError
from station.session.log.bag import MANIFEST
from tests.station.archive.conftest import NOW, STRANGE

ADDRESS = "https://example.org/v"


def source_of(page):
    return load_scan(page.find(Role.ORIGINAL).path.parent)


def export(volume, kind, out):
    return deliver(volume, Format(kind), out, address=ADDRESS, now=NOW, source=source_of)


def names(folder) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_a_bag_is_valid_for_the_library_of_congress(volume, tmp_path) -> None:
    bagit = pytest.importorskip("bagit", reason="needs bagit, the Library of Congress's validator")
    done = export(volume, "bagit", tmp_path / "bag")
    bag = bagit.Bag(str(tmp_path / "bag"))
    assert bag.validate()
    assert bag.info["External-Description"] == STRANGE
    assert bag.info["Internal-Sender-Description"] == "incomplete: page 3: not restored"
    assert done.missing == ("page 3: not restored",)
    assert set(bag.payload_files()) == {
        "data/mets.xml",
        "data/pages.csv",
        *(f"data/{file.name}" for file in volume.files),
    }


@pytest.mark.parametrize("damage", ["flip", "delete", "add"])
def test_the_validator_notices_a_damaged_bag(volume, tmp_path, damage) -> None:
    bagit = pytest.importorskip("bagit", reason="needs bagit, the Library of Congress's validator")
    export(volume, "bagit", tmp_path / "bag")
    path = tmp_path / "bag/data/mets.xml"
    if damage == "flip":
        data = bytearray(path.read_bytes())
        data[100] ^= 1
        path.write_bytes(data)
    elif damage == "delete":
        path.unlink()
    else:
        (path.parent / "more.txt").write_text("x")
    with pytest.raises(bagit.BagValidationError):
        bagit.Bag(str(tmp_path / "bag")).validate()


@pytest.mark.parametrize("kind", ["mets", "iiif", "pdf", "tiff", "mesh"])
def test_other_formats_carry_a_manifest_of_their_files(volume, tmp_path, kind) -> None:
    done = export(volume, kind, tmp_path / "out")
    assert done.files == len(names(tmp_path / "out")) - 1
    listed = {line.split("  ")[1] for line in (tmp_path / "out" / MANIFEST).read_text().splitlines()}
    assert listed == names(tmp_path / "out") - {MANIFEST}
    check = ["sha512sum", "--check", "--strict", "--quiet", MANIFEST]
    subprocess.run(check, cwd=tmp_path / "out", check=True, capture_output=True)


def test_what_each_format_holds(volume, tmp_path) -> None:
    for kind in ("mets", "iiif", "pdf", "tiff", "mesh"):
        export(volume, kind, tmp_path / kind)
    assert "mets.xml" in names(tmp_path / "mets")
    assert {"0001.tif", "0002.tif"} == names(tmp_path / "tiff") - {MANIFEST, "pages.csv"}
    assert {"volume.pdf"} == names(tmp_path / "pdf") - {MANIFEST, "pages.csv"}
    assert {f"{n:04}.{end}" for n in (1, 2, 3) for end in ("glb", "ply", "obj", "mtl", "png")} == names(
        tmp_path / "mesh"
    ) - {MANIFEST}


def test_an_iiif_folder_has_every_file_that_it_names(volume, tmp_path) -> None:
    export(volume, "iiif", tmp_path / "web")
    manifest = json.loads((tmp_path / "web/manifest.json").read_text())
    for canvas in manifest["items"]:
        body = canvas["items"][0]["items"][0]["body"]
        for address in (body["id"], canvas["thumbnail"][0]["id"], f"{body['service'][0]['id']}/info.json"):
            assert (tmp_path / "web" / address.removeprefix(f"{ADDRESS}/")).is_file()


def test_what_is_missing_is_named(volume) -> None:
    assert missing(volume, Role.ORIGINAL, Role.PAGE) == ["page 3: not restored"]
    without = dataclasses.replace(volume, pages=volume.pages[1:])
    assert missing(without, Role.ORIGINAL) == ["page 1: not captured"]


def test_nothing_to_export_makes_no_folder(volume, tmp_path) -> None:
    bare = dataclasses.replace(volume, pages=volume.pages[2:])
    with pytest.raises(BadInput, match="page 3: not restored"):
        export(bare, "tiff", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_damaged_file_ends_the_export_and_leaves_nothing(volume, tmp_path) -> None:
    page = volume.pages[0]
    broken = tmp_path / page.files[0].path.name
    broken.write_bytes(b"\0" + page.files[0].path.read_bytes()[1:])
    files = (dataclasses.replace(page.files[0], path=broken), *page.files[1:])
    damaged = dataclasses.replace(volume, pages=(dataclasses.replace(page, files=files), *volume.pages[1:]))
    with pytest.raises(BadInput, match="its digest has changed"):
        export(damaged, "bagit", tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == [broken.name]


def test_a_disk_that_fills_up_leaves_nothing(volume, tmp_path, monkeypatch) -> None:
    written = []

    def refuse(path, data):
        if len(written) == 3:
            raise OSError(28, "No space left on device", str(path))
        written.append(path)
        path.write_bytes(data)

    monkeypatch.setattr(delivery, "write_file", refuse)
    with pytest.raises(OSError, match="No space"):
        export(volume, "iiif", tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("kind", "name"), [("bagit", "data/"), ("pdf", "volume.pdf"), ("tiff", "0001.tif")])
def test_a_disk_that_refuses_is_named_by_the_file_of_the_export(volume, tmp_path, small_files, kind, name) -> None:
    with small_files, pytest.raises(OSError, match="too large") as raised:
        export(volume, kind, tmp_path / "out")
    assert str(raised.value.filename).startswith(str(tmp_path / "out" / name))


def test_an_earlier_export_stays_as_it_is(volume, tmp_path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out/mine.txt").write_text("mine")
    with pytest.raises(OverwriteError):
        export(volume, "tiff", tmp_path / "out")
    assert names(tmp_path / "out") == {"mine.txt"}


def test_meshes_are_without_the_table(volume, tmp_path) -> None:
    """A page 8 mm above a table, as a scanner sees both."""
    rows, cols = np.indices((60, 80)).astype(float)
    page = (np.abs(rows - 30) < 20) & (np.abs(cols - 40) < 25)
    depth = np.where(page, 592.0, 600.0)
    directions = np.stack([(cols - 39.5) / 400, (29.5 - rows) / 400, -np.ones_like(rows)], axis=2)
    colours = np.where(page[..., None], (232, 228, 218), (62, 58, 55)).astype(np.uint8)
    scan = RangeScan(directions * depth[..., None], colours, np.stack([cols, rows], axis=2), {"device": "stand-in"})
    deliver(volume, Format.MESH, tmp_path / "out", address=ADDRESS, now=NOW, source=lambda _: scan)
    mesh = load_scan(tmp_path / "out" / "0001.ply")
    depths = -np.asarray(getattr(mesh, "vertices", getattr(mesh, "points", None))).reshape(-1, 3)[:, 2]
    assert np.nanmax(depths) < 596.0
    assert np.isfinite(depths).sum() == pytest.approx(page.sum(), rel=0.1)
