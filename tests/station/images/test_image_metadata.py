"""What the files of a page tell of its making, read back by Pillow and tifffile."""

from __future__ import annotations

import io
from datetime import UTC, datetime
from xml.etree import ElementTree

import numpy as np
import pikepdf
import pytest
import tifffile
from PIL import ExifTags, Image

from restore.errors import BadInput
from station.cli import main
from station.images.icc import MatrixProfile, encode_profile, read_profile, srgb_matrix, srgb_profile
from station.images.image_metadata import NAMESPACES, ImageMetadata, software
from station.images.png import encode_png
from station.images.tiff import encode_tiff

SHOT = {"device": "Vivid 900", "lens": "MIDDLE", "time": "2026-05-04T03:02:01+00:00", "seed": 1}
OTHER = encode_profile(MatrixProfile("other", srgb_matrix()[:, ::-1], ((2.0, 1.0, 0.0, 1.0, 0.0),) * 3))


def xmp_of(packet: bytes) -> dict[str, str]:
    about = ElementTree.fromstring(packet.decode("utf-8").split("?>", 1)[1].rsplit("<?", 1)[0])[0][0]
    return {element.tag.split("}")[1]: element.text for element in about}


@pytest.mark.parametrize("profile", [None, OTHER])
def test_png_records_its_making(page, profile):
    with Image.open(io.BytesIO(encode_png(page.image, 150, ImageMetadata.from_provenance(SHOT, profile)))) as file:
        exif = file.getexif()
        assert file.info["icc_profile"] == (profile or srgb_profile())
        assert xmp_of(file.info["XML:com.adobe.xmp"].encode())["LensModel"] == "MIDDLE"
        np.testing.assert_array_equal(np.asarray(file), page.image)
    assert (exif[ExifTags.Base.Model], exif[ExifTags.Base.Software]) == ("Vivid 900", software())
    details = exif.get_ifd(ExifTags.IFD.Exif)
    assert details[ExifTags.Base.LensModel] == "MIDDLE"
    assert details[ExifTags.Base.DateTimeOriginal] == "2026:05:04 03:02:01"
    assert details[ExifTags.Base.OffsetTimeOriginal] == "+00:00"


def test_tiff_records_its_making(page):
    with tifffile.TiffFile(
        io.BytesIO(encode_tiff(page.image, 150.0, ImageMetadata.from_provenance(SHOT, OTHER)))
    ) as file:
        tags = {tag.name: tag.value for tag in file.pages[0].tags}
        np.testing.assert_array_equal(file.asarray(), page.image)
    assert tags["InterColorProfile"] == OTHER
    assert (tags["Make"], tags["Model"], tags["Orientation"]) == ("Minolta", "Vivid 900", 1)
    assert tags["Software"] == software()
    assert tags["DateTime"] == "2026:05:04 03:02:01"
    assert xmp_of(bytes(tags["XMP"])) == {
        "CreatorTool": software(),
        "CreateDate": "2026-05-04T03:02:01+00:00",
        "Model": "Vivid 900",
        "LensModel": "MIDDLE",
    }


@pytest.mark.parametrize("shot", [{}, {"time": "yesterday", "device": None}, {"time": 5}])
def test_unknown_values_are_not_written(page, shot):
    metadata = ImageMetadata.from_provenance(shot)
    assert metadata.time is None
    assert "CreateDate" not in xmp_of(metadata.xmp())
    assert encode_tiff(page.image, 150.0, metadata)


def test_xmp_escapes_what_xml_would_misread():
    metadata = ImageMetadata(b"", "planish", device='<Vivid & "900">', time=datetime(2026, 1, 2, tzinfo=UTC))
    assert xmp_of(metadata.xmp())["Model"] == '<Vivid & "900">'
    assert NAMESPACES["exifEX"].encode() not in metadata.xmp()  # no lens, no namespace


def test_a_profile_reaches_every_file_of_the_page(library, scan_file, tmp_path):
    (tmp_path / "camera.icc").write_bytes(OTHER)
    options = ["--icc-profile", str(tmp_path / "camera.icc"), "--tiff"]
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out"), *options]) == 0
    for name in ("book.png", "book.tif"):
        with Image.open(tmp_path / "out" / name) as file:
            assert file.info["icc_profile"] == OTHER


@pytest.mark.parametrize(
    "data", [b"", b"words", OTHER[:-1], OTHER[:16] + b"CMYK" + OTHER[20:], OTHER[:36] + b"none" + OTHER[40:]]
)
def test_what_is_not_a_profile_is_refused_before_any_work(library, scan_file, tmp_path, capsys, data):
    (tmp_path / "camera.icc").write_bytes(data)
    with pytest.raises(BadInput):
        read_profile(tmp_path / "camera.icc")
    options = ["-o", str(tmp_path / "out"), "--icc-profile", str(tmp_path / "camera.icc")]
    assert main(["restore", str(scan_file), *options]) == 3
    assert "camera.icc" in capsys.readouterr().err
    assert library.calls == []


def test_the_pdf_shows_its_picture_in_the_colours_of_its_profile(page):
    from station.page_files.pdf import encode_pdf
    from station.words.words import Words

    layer = io.BytesIO()
    with pikepdf.new() as pdf:
        pdf.add_blank_page(page_size=(100, 100))
        pdf.save(layer)
    words = Words("", b"", b"", (), layer.getvalue(), "en", 96.0)
    made = encode_pdf(page.image, 150.0, words, title="page", profile=OTHER)
    with pikepdf.open(io.BytesIO(made)) as pdf:
        assert pdf.pages[0].Resources.XObject.Page.ColorSpace[1].read_bytes() == OTHER
        assert pdf.Root.OutputIntents[0].DestOutputProfile.read_bytes() == srgb_profile()
