"""The files: what is in them when they are read again."""

from __future__ import annotations

import io
import json
import struct
from dataclasses import replace

import numpy as np
import pytest
import tifffile
from PIL import Image

from restore import Finding, SurfaceMesh
from station.images.coverage import encode_coverage
from station.images.png import encode_png
from station.images.tiff import encode_map, encode_tiff, encode_uncertainty
from station.page_files import outputs
from station.page_files.mesh import encode_flat, encode_warped
from station.page_files.report import INTEGRITY, encode_report, finite, summary
from station.storage.disk import write_file

HALF_PIXEL_PER_METRE = 0.5 * 0.0254  # pHYs counts whole pixels a metre
OBJ_DIGITS_MM = 0.5e-6


def png_chunk(data: bytes, name: bytes) -> bytes:
    at = data.index(name)
    (length,) = struct.unpack(">I", data[at - 4 : at])
    return data[at + 4 : at + 4 + length]


@pytest.mark.parametrize("dpi", [30, 150, 300, 1200])
def test_png_shows_its_resolution(page, dpi):
    data = encode_png(page.image, dpi)
    x, y, unit = struct.unpack(">IIB", png_chunk(data, b"pHYs"))
    assert (x, unit) == (y, 1)  # 1: pixels a metre
    assert x * 0.0254 == pytest.approx(dpi, abs=HALF_PIXEL_PER_METRE)
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(data))), page.image)


def test_png_without_a_scale_has_no_resolution(page):
    assert b"pHYs" not in encode_png(page.image)


def test_tiff_shows_its_resolution(page):
    with tifffile.TiffFile(io.BytesIO(encode_tiff(page.image, 150.0))) as file:
        tags = file.pages[0].tags
        assert tags["XResolution"].value == tags["YResolution"].value == (150, 1)
        assert tags["ResolutionUnit"].value == 2  # inch
        np.testing.assert_array_equal(file.asarray(), page.image)


def test_map_has_two_channels_of_float32(page):
    page_map = page.page_map.copy()
    page_map[0, 0] = np.nan
    data = tifffile.imread(io.BytesIO(encode_map(page.with_pictures(page_map=page_map))))
    assert data.dtype == np.float32
    np.testing.assert_array_equal(data, page_map)


def test_map_of_a_page_from_photographs_shows_the_source_of_every_pixel(page):
    page_map, source = page.page_map.copy(), np.zeros(page.mask.shape, np.uint8)
    source[:, 5:] = 2
    page_map[0, 0], source[0, 0] = np.nan, 255
    report = {**page.report, "photos": [{"name": "far.jpg"}, {"name": "near.jpg"}]}
    data = encode_map(replace(page.with_pictures(page_map=page_map, page_source=source), report=report))
    with tifffile.TiffFile(io.BytesIO(data)) as file:
        layers, said = file.asarray(), json.loads(file.pages[0].description)
    np.testing.assert_array_equal(layers[..., :2], page_map)
    assert said["channels"] == ["source x", "source y", "source"]
    assert said["sources"] == ["the scan's colour image", "far.jpg", "near.jpg"]
    assert np.isnan(layers[0, 0, 2])
    np.testing.assert_array_equal(layers[1:, :, 2], source[1:])


def test_uncertainty_is_one_channel_of_float32_in_millimetres(page):
    sigma = np.where(page.mask, np.float32(0.02), np.float32(np.nan))
    with tifffile.TiffFile(io.BytesIO(encode_uncertainty(sigma, page.dpi))) as file:
        np.testing.assert_array_equal(file.asarray(), sigma)
        assert json.loads(file.pages[0].description)["unit"] == "mm"


def test_a_page_without_uncertainty_has_no_file_of_it(page, scan):
    kinds = frozenset({"uncertainty"})
    assert "page-uncertainty.tif" in outputs.names("page", kinds)
    assert "page-uncertainty.tif" not in outputs.names("page", kinds, page)
    stated = page.with_pictures(uncertainty=np.zeros(page.mask.shape, np.float32))
    assert "page-uncertainty.tif" in outputs.names("page", kinds, stated)
    done = outputs.Restoration("page", stated, scan, (), {})
    assert len(list(outputs.encode_outputs(done, kinds))) == 3


def obj_rows(data: bytes, key: str) -> list[list[str]]:
    return [line.split()[1:] for line in data.decode().splitlines() if line.split()[0] == key]


def test_obj_holds_the_page_flat_and_warped(page):
    mesh = page.flat
    flat, warped = encode_flat(mesh, "m.mtl"), encode_warped(mesh, "m.mtl")
    np.testing.assert_allclose(np.array(obj_rows(flat, "v"), float)[:, :2], mesh.flat, atol=OBJ_DIGITS_MM)
    np.testing.assert_allclose(np.array(obj_rows(warped, "v"), float), mesh.vertices, atol=OBJ_DIGITS_MM)
    corners = [[tuple(map(int, corner.split("/"))) for corner in row] for row in obj_rows(flat, "f")]
    np.testing.assert_array_equal(np.array(corners)[..., 0] - 1, mesh.faces)
    np.testing.assert_array_equal(np.array(corners)[..., 1] - 1, mesh.faces)


def test_obj_texture_coordinates_run_from_edge_to_edge(page):
    height, width = page.image.shape[:2]
    edges = np.array([[-0.5, -0.5], [width - 0.5, height - 0.5], [0, 0]])
    mesh = SurfaceMesh(np.zeros((3, 3)), np.array([[0, 1, 2]]), edges, page.image)
    uv = np.array(obj_rows(encode_warped(mesh, "m.mtl"), "vt"), float)
    np.testing.assert_allclose(uv[:2], [[0, 1], [1, 0]], atol=1e-8)


def test_obj_reads_back_as_the_library_reads_scans(page, scan, tmp_path):
    from restore.formats import load_scan, read_image

    done = outputs.Restoration("page", page, scan, (), {})
    for name, data in zip(outputs.names("page", {"mesh"}), outputs.encode_outputs(done, {"mesh"}), strict=True):
        write_file(tmp_path / name, data)
    np.testing.assert_array_equal(read_image(tmp_path / "page.png"), page.image)
    mesh = load_scan(tmp_path / "page-flat.obj")
    assert isinstance(mesh, SurfaceMesh)
    np.testing.assert_array_equal(mesh.texture, page.flat.texture)
    assert len(mesh.faces) == len(page.flat.faces)


def test_obj_without_colour_refers_to_none(page, scan):
    bare = replace(page, flat=replace(page.flat, texture=None, texcoords=None))
    assert b"mtl" not in encode_flat(bare.flat, "m.mtl")
    done = outputs.Restoration("page", bare, scan, (), {})
    assert len(list(outputs.encode_outputs(done, {"mesh"}))) == len(outputs.names("page", {"mesh"}, bare)) == 5


def test_page_and_report_are_always_written():
    assert outputs.names("book", frozenset()) == ["book.png", "book.json"]


def test_report_is_strict_json():
    report = finite({"a": float("nan"), "b": [1, float("inf")], "c": {"d": (2.5, None, "x", True)}})
    assert json.loads(encode_report(report)) == {"a": None, "b": [1, None], "c": {"d": [2.5, None, "x", True]}}


def test_report_holds_any_file_name():
    name = "page\udcff.png"  # how Python shows a byte that is no UTF-8
    assert json.loads(encode_report({"files": [name]}).encode()) == {"files": [name]}


def test_summary_without_colour_and_with_a_warning(page, tmp_path):
    report = dict(page.report) | {"resolved_ppi": 0.0, "sampling_ppi": 0.0, "peak_memory_mb": 512.3}
    report["findings"] = [Finding.of("hidden", 0.2).as_json()]
    text = summary(report, [tmp_path / "page.png"])
    assert "no colour image" in text
    assert "20% of the page is hidden" in text
    assert "flatten 0.50" in text
    assert "512 MB" in text


def test_summary_of_a_page_without_edges_says_that_its_resolution_cannot_be_measured(page):
    text = summary({**page.report, "resolved_ppi": None, "sampling_ppi": 53.4, "peak_memory_mb": 512.0}, [])
    assert "53 pixels per inch; what they resolve cannot be measured" in text


@pytest.mark.parametrize(("integrity", "reported"), [*INTEGRITY.items(), ("unknown", "")])
def test_summary_shows_how_reliable_the_samples_are(page, integrity, reported):
    text = summary({**page.report, "source": {"integrity": integrity}, "peak_memory_mb": 512.0}, [])
    assert ("samples" in text) == bool(reported)
    assert reported in text


def test_summary_says_how_well_size_and_places_are_known(page):
    report = {**page.report, "peak_memory_mb": 512.0}
    assert "known to" not in summary({**report, "size_mm_ci95": None}, [])
    sized = {**report, "size_mm_ci95": [2.744, 1.96], "calibration": {"kind": "nominal"}}
    assert "known to ± 2.74 × 1.96 mm (95 %), calibration nominal" in summary(sized, [])
    stated = {"noise": 0.004, "method": 0.012, "total": 0.0126, "p95": 0.031}
    assert "places uncertain by 0.013 mm rms, 95 % within 0.031 mm" in summary({**sized, "uncertainty_mm": stated}, [])
    assert "not estimated: it is a mesh" in summary({**report, "uncertainty_mm": {"reason": "it is a mesh"}}, [])


def test_summary_shows_what_a_photograph_gave(page):
    used = {"accepted": True, "textured_fraction": 0.98, "resolved_ppi": 486.2, "residual_px": 0.62}
    photos = [{"name": "window.jpg", **used}, {"name": "other.jpg", "accepted": False, "reason": "it is blank"}]
    said = {
        "photos": photos,
        "findings": [Finding.of("photo_refused", name="other.jpg", reason="it is blank").as_json()],
        "peak_memory_mb": 512.0,
    }
    text = summary({**page.report, **said}, [])
    assert "window.jpg gives 98% of the page and resolves 486 pixels per inch, registered to 0.6 pixels rms" in text
    assert text.count("other.jpg") == 1


def test_coverage_keeps_its_values_and_has_colours():
    seen = np.arange(5, dtype=np.uint8).repeat(6).reshape(5, 6)
    picture = Image.open(io.BytesIO(encode_coverage(seen, 150.0)))
    assert picture.mode == "P"
    np.testing.assert_array_equal(np.asarray(picture), seen)
    assert picture.info["dpi"] == pytest.approx((150, 150), abs=0.02)
    assert len({tuple(colour) for colour in np.asarray(picture.convert("RGB"))[:, 0]}) == 5
