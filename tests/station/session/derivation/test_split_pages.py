"""An opened book in a session: both leaves are restored, judged, shown, exported and reproduced."""

from __future__ import annotations

import shutil
from datetime import UTC, datetime

import pytest

from restore import load_scan, save_scan
from station.archive.deliver import Format, deliver
from station.archive.from_session import scan_of, volume_of
from station.archive.volume import Role
from station.cli import main
from station.session import correct, scan_path, undo
from station.session.corrections.files import export_edits
from station.session.derivation.reproduce import reproduce
from station.session.derivation.service import Derivation, restore_job
from station.session.fixity.verify import verify
from station.session.leaves.leaf import leaves_of
from station.session.leaves.overview import overview, overview_lines
from station.session.terms.rules import edits_of
from tests.restore.layout.conftest import PAGE_MM, SPINE_MM

SIZE_MM = 1.5  # two samples of the fast mode
NOW = datetime(2026, 1, 2, tzinfo=UTC)


def restore_all(writer):
    """What a batch does, in this process."""
    derivation = Derivation(writer)
    for capture in list(derivation.due()):
        job = derivation.job(capture)
        derivation.settle(job, restore_job(job).result)


def test_both_leaves_reach_everything(opening, tmp_path):
    restore_all(opening)
    session = opening.session
    left, right = leaves_of(session)
    for leaf, width in ((left, SPINE_MM), (right, PAGE_MM[0] - SPINE_MM)):
        assert leaf.restored.page_mm == pytest.approx((width + 1.0, PAGE_MM[1]), abs=SIZE_MM)
        assert {"smooth_strain_rms", "blur_px"} <= {check.name for check in leaf.checks}
    assert [part["name"] for part in overview(session)["pages"][0]["parts"]] == ["1/left", "1/right"]
    assert sum(line.split()[0] in ("1/left", "1/right") for line in overview_lines(session)) == 2
    volume = volume_of(session)
    assert [(page.number, page.label, page.side, page.name) for page in volume.pages] == [
        (1, "1", "left", "1/left"),
        (2, "2", "right", "1/right"),
    ]
    one, two = volume.pages
    assert one.find(Role.PAGE) != two.find(Role.PAGE)
    assert one.find(Role.ORIGINAL) == two.find(Role.ORIGINAL)
    for kind, count in ((Format.TIFF, 2), (Format.IIIF, 2), (Format.METS, 2), (Format.MESH, 1)):
        made = deliver(
            volume, kind, tmp_path / kind, address="http://a", now=NOW, source=lambda page: scan_of(session, page)
        )
        assert [line for line in made.missing if "words" not in line] == []
        pattern = {Format.TIFF: "*.tif", Format.IIIF: "images/*/info.json", Format.MESH: "*.ply"}.get(
            kind, "**/page-*t.png"
        )
        assert len(list((tmp_path / kind).glob(pattern))) == count
    assert [(one.event.name, one.differing) for one in reproduce(session, tmp_path / "again")] == [
        ("restore", ()),
        ("verdict", ()),
    ]
    copy = shutil.copytree(session.folder, tmp_path / "copy")  # the session itself has a opening
    assert verify(copy).problems == ()


def test_a_correction_and_its_undo(opening, tmp_path):
    """The same corrections of the exported scan give the same page to the byte."""
    restore_all(opening)
    split = opening.history.page(1).runs["restore"]
    edits = {"layout": "right", "parts": {"right": {"turn": 1, "settings": {"dpi": 40}}}}
    correct(opening, 1, edits_of(edits))
    assert [page.problem[:9] for page in volume_of(opening.session).pages] == ["corrected"] * 2
    restore_all(opening)
    (leaf,) = leaves_of(opening.session)
    assert (leaf.name, leaf.side, leaf.restored.dpi) == ("1/right", "right", 40)
    export_edits(opening.session, opening.history.page(1), tmp_path / "book.edits.json")
    save_scan(load_scan(scan_path(opening.session, leaf.page.capture)), tmp_path / "loose" / "book.scan")
    options = ["--points", "300", "--dpi", "50", "--edits", str(tmp_path / "book.edits.json")]
    assert main(["restore", str(tmp_path / "loose" / "book.scan"), "-o", str(tmp_path / "out"), *options]) == 0
    run = leaf.page.runs["restore"]
    assert (tmp_path / "out" / "book.png").read_bytes() == opening.session.path(run, "page.png").read_bytes()
    undo(opening)
    assert opening.history.page(1).runs["restore"] == split
    restore_all(opening)
    assert len(leaves_of(opening.session)) == 2
    assert {one.differing for one in reproduce(opening.session, tmp_path / "again")} == {()}
