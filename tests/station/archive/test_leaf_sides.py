"""The leaf sides of a volume are the same list in every format, and from right to left where it is read so."""

from __future__ import annotations

import csv
import json

import numpy as np
import pikepdf
import pytest
from lxml import etree

from restore import CoverageClass
from station.archive.formats import Format
from station.cli import main
from station.images.coverage import encode_coverage
from station.images.pages import read_page
from station.images.png import encode_png
from station.session import Volume, add_scan, create_session, open_session
from station.session.leaves.leaf import leaves_of
from station.session.log.steps import decide, record_run
from station.session.operations.corrections import correct
from station.session.terms.about import ABOUT
from station.session.terms.labels import LABELS
from station.session.terms.rules import edits_of
from tests.station.archive.schema import schema, violations
from tests.station.conftest import curl_scan

ALTO = """<?xml version="1.0" encoding="UTF-8"?>
<alto xmlns="http://www.loc.gov/standards/alto/ns-v4#"><Description><MeasurementUnit>pixel</MeasurementUnit>
<sourceImageInformation><fileName>page.png</fileName></sourceImageInformation></Description>
<Layout><Page ID="page_0" PHYSICAL_IMG_NR="0" WIDTH="60" HEIGHT="90"/></Layout></alto>"""
NAMES = {
    "m": "http://www.loc.gov/METS/",
    "a": "http://www.loc.gov/standards/alto/ns-v4#",
    "p": "info:lc/xmlns/premis-v2",
}
STRIP_PX = 4
SIX = ("", "1v", "2r", "2v", "3r", "3v–4r")
SPINE = [[5.0, 1.0], [6.0, 8.0]]


def write_leaf(folder, stem, width=60):
    """A leaf of a picture with words and a strip of the facing page on its right, or left."""
    picture = np.full((90, width, 3), 255, np.uint8)
    seen = np.full((90, width), CoverageClass.MEASURED, np.uint8)
    seen[:, slice(-STRIP_PX, None) if stem.endswith("left") else slice(0, STRIP_PX)] = CoverageClass.FACING
    contents = {
        ".png": encode_png(picture, 150.0),
        "-coverage.png": encode_coverage(seen, 150.0),
        "-alto.xml": ALTO.encode(),
    }
    for ending, data in contents.items():
        (folder / f"{stem}{ending}").write_bytes(data)


@pytest.fixture
def book(tmp_path):
    """A session of a cover, two openings and a plate; the first opening was corrected by hand."""
    create_session(tmp_path / "book", Volume(title="A book"))
    with open_session(tmp_path / "book") as writer:
        for number, stems in enumerate(
            (["page"], ["page-left", "page-right"], ["page-left", "page-right"], ["page"]), 1
        ):
            capture = add_scan(writer, curl_scan(), facts={})
            folder = writer.staging("page")
            folder.mkdir(parents=True)
            for stem in stems:
                write_leaf(folder, stem)
            report = {"page_mm": [10.0, 15.0], "layout": {"frame": "picture", "spine": SPINE}}
            result = {"parts": {"left": report, "right": report}} if len(stems) > 1 else {"page_mm": [10.0, 15.0]}
            kind = {1: {"kind": "cover"}, 4: {"kind": "plate"}}.get(number, {})
            if number == 2:
                kind = {"spine": SPINE, "by": {"operator": "A. B.", "tool": "cli"}}
            if kind:
                correct(writer, number, edits_of(kind))
            edits = {name: value for name, value in kind.items() if name != "by"}
            parameters = {"edits": {"layout": "whole", **edits} if "kind" in kind else edits} if kind else {}
            record_run(writer, "restore", capture, parameters=parameters, result=result, files=folder)
        decide(writer, LABELS, [{"from": "2/left", "style": "folio", "side": "verso"}])
    return tmp_path / "book"


def export(book, out, kind, *words):
    assert main(["export", str(book), "--to", kind, "-o", str(out / kind), *words]) == 0
    return out / kind


def labels_in(book, out):
    """The labels of each format, in the order of its pages."""
    for kind in ("mets", "iiif", "pdf"):
        export(book, out, kind)
    mets = etree.parse(out / "mets" / "mets.xml")
    pages = mets.xpath("//m:structMap[@TYPE='PHYSICAL']//m:div[@TYPE='page']", namespaces=NAMES)
    words = [etree.parse(path).find(".//a:Page", NAMES) for path in (out / "mets").rglob("*-alto.xml")]
    words.sort(key=lambda page: int(page.get("PHYSICAL_IMG_NR")))
    with (out / "pdf" / "pages.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    with pikepdf.open(out / "pdf" / "volume.pdf") as pdf:
        shown = [page.label for page in pdf.pages]
    manifest = json.loads((out / "iiif" / "manifest.json").read_text())
    return {
        "mets": tuple(page.get("ORDERLABEL", "") for page in pages),
        "alto": tuple(page.get("PRINTED_IMG_NR", "") for page in words),
        "csv": tuple(row["label"] for row in table),
        "pdf": tuple(shown),
        "iiif": tuple(canvas.get("label", {"none": [""]})["none"][0] for canvas in manifest["items"]),
    }


def test_labels_are_the_same_list_in_every_format(book, tmp_path):
    found = labels_in(book, tmp_path / "ltr")
    assert found == dict.fromkeys(found, SIX)
    with open_session(book) as writer:
        decide(writer, ABOUT, {"direction": "rtl"})
        decide(writer, LABELS, [{"from": "2/right", "style": "folio", "side": "verso"}])
        assert [leaf.name for leaf in leaves_of(writer.session)] == ["1", "2/right", "2/left", "3/right", "3/left", "4"]
    found = labels_in(book, tmp_path / "rtl")
    assert found == dict.fromkeys(found, SIX)
    manifest = json.loads((tmp_path / "rtl/iiif/manifest.json").read_text())
    assert manifest["viewingDirection"] == "right-to-left"
    with pikepdf.open(tmp_path / "rtl/pdf/volume.pdf") as pdf:
        assert pdf.Root.ViewerPreferences.Direction == "/R2L"


def test_each_format_knows_covers_openings_and_runs(book, tmp_path):
    manifest = json.loads((export(book, tmp_path, "iiif") / "manifest.json").read_text())
    assert [canvas.get("behavior") for canvas in manifest["items"]] == [None] * 5 + [["facing-pages"]]
    ranges = [(one["label"]["none"][0], len(one["items"])) for one in manifest["structures"]]
    assert ranges == [("cover", 1), ("1v–3v–4r", 5)]
    with pikepdf.open(export(book, tmp_path, "pdf") / "volume.pdf") as pdf, pdf.open_outline() as outline:
        assert [item.title for item in outline.root] == ["cover", "1v–3v–4r"]
        assert pdf.Root.PageLayout == "/TwoPageRight"
    with (tmp_path / "pdf/pages.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["capture"], row["part"], row["kind"]) for row in rows] == [
        ("1", "page", "cover"),
        ("2", "left", ""),
        ("2", "right", ""),
        ("3", "left", ""),
        ("3", "right", ""),
        ("4", "page", "plate"),
    ]
    assert (rows[1]["width_mm"], rows[1]["edits"] != "", rows[3]["edits"]) == ("10.00", True, "")


def test_mets_has_each_leaf_side_and_who_corrected_it(book, tmp_path):
    data = (export(book, tmp_path, "mets") / "mets.xml").read_bytes()
    assert violations(schema("mets-1-12-1.xsd", "premis-v2-3.xsd", "mix20.xsd"), data) == []
    root = etree.fromstring(data)
    areas = root.xpath("//m:div[@TYPE='page'][@ORDER='2' or @ORDER='3']//m:area", namespaces=NAMES)
    assert len({area.get("FILEID") for area in areas}) == 1
    left, right = (list(map(int, area.get("COORDS").split(","))) for area in areas)
    assert (left[0], right[0] > left[2]) == (0, True)
    assert set(zip(left[2:-2:2], left[3:-2:2], strict=True)) == set(zip(right[2:-2:2], right[3:-2:2], strict=True))
    agents = {
        one.findtext("p:agentName", namespaces=NAMES): one.findtext("p:agentType", namespaces=NAMES)
        for one in root.iter(f"{{{NAMES['p']}}}agent")
    }
    assert agents["A. B."] == "person"
    kinds = [one.text for one in root.iter(f"{{{NAMES['p']}}}eventType")]
    assert kinds.count("modification") == 4  # three corrections, and the places in the words
    alto = next((tmp_path / "mets").rglob("page-left-alto.xml")).read_bytes()
    assert violations(schema("alto-4-4.xsd"), alto) == []
    page = etree.fromstring(alto).find(".//a:Page", NAMES)
    assert page.get("POSITION") == "Left"
    assert main(["verify", str(tmp_path / "mets")]) == 0


def test_the_strip_of_the_facing_page_is_trimmed_where_it_is(book, tmp_path):
    kept, trimmed = (export(book, tmp_path / one, "tiff", "--overlap", one) for one in ("keep", "trim"))
    widths = [[read_page(path).image.shape[1] for path in sorted(folder.glob("*.tif"))] for folder in (kept, trimmed)]
    assert widths == [[60] * 6, [60, 56, 56, 56, 56, 60]]
    with pikepdf.open(export(book, tmp_path / "trim", "pdf", "--overlap", "trim") / "volume.pdf") as pdf:
        boxes = [float(page.mediabox[2]) for page in pdf.pages]
    assert boxes == pytest.approx([px / 150 * 72 for px in widths[1]], abs=1e-3)


def test_names_that_clash_are_refused_before_anything_is_written(book, tmp_path, capsys):
    out = export(book, tmp_path, "tiff", "--names", "{order:02}_{label}")
    assert "03_2r.tif" in {path.name for path in out.iterdir()}
    with open_session(book) as writer:
        decide(writer, "label_left", "1v", page=3)
    clash = ["export", str(book), "--to", "tiff", "-o", str(tmp_path / "clash"), "--names", "label"]
    assert main(clash) == 2
    assert "pages 2 and 4 would both be 1v" in capsys.readouterr().err
    assert not (tmp_path / "clash").exists()


def test_a_whole_that_was_not_kept_is_named_or_refused(book, tmp_path, capsys):
    words = ["export", str(book), "--to", "tiff", "--parts", "whole", "-o"]
    assert main([*words, str(tmp_path / "none")]) == 2
    assert "no opening was kept whole" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()
    with open_session(book) as writer:
        capture = writer.history.page(3).capture
        folder = writer.staging("page")
        folder.mkdir(parents=True)
        for stem in ("page", "page-left", "page-right"):
            write_leaf(folder, stem)
        result = {"parts": {part: {"page_mm": [10.0, 15.0]} for part in ("page", "left", "right")}}
        record_run(writer, "restore", capture, parameters={}, result=result, files=folder)
    assert main([*words, str(tmp_path / "some")]) == 0
    shown = capsys.readouterr().out
    assert [line.split()[2] for line in shown.splitlines() if "no whole was kept" in line] == ["2/left:", "2/right:"]
    assert len(list((tmp_path / "some").glob("*.tif"))) == 5  # cover, two leaves, a whole, plate


@pytest.mark.parametrize("kind", ["bagit", "mets", "iiif", "pdf", "tiff"])
def test_every_format_of_pages_has_their_table(book, tmp_path, kind):
    assert kind in list(Format)
    (table,) = export(book, tmp_path, kind).rglob("pages.csv")
    assert table.read_text().count("\n") == 7
