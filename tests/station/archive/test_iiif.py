"""The manifest and the image services: valid, whole, and put together again from their tiles they are the page."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from station.archive.iiif import (
    TILE,
    PageImage,
    encode_info,
    encode_manifest,
    encode_tiles,
    folder_address,
    scale_factors,
)
from station.archive.volume import Page
from station.errors import UsageError
from tests.station.archive.conftest import picture

ADDRESS = "https://example.org/volume"
LEVELS = 4.0  # of 255, rms: JPEG at quality 90 on a page of text
SIDES = st.integers(1, 1700)


def image(width: int, height: int) -> np.ndarray:
    """A picture that differs everywhere, and is smooth, so that JPEG keeps it."""
    x, y = np.meshgrid(np.linspace(0, 255, width), np.linspace(0, 255, height))
    return np.stack([x, y, (x + y) / 2], axis=2).astype(np.uint8)


def decoded(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)))


def requested(info: dict, factor: int) -> list[tuple[str, tuple[int, int, int, int]]]:
    """The canonical requests of a viewer for a reduction (Image API 3.0, 4.7), each with its place in that.

    Written from the clause, not from the encoder: region `full` for the whole, size `max` for the whole at its size.
    """
    width, height, side = info["width"], info["height"], info["tiles"][0]["width"]
    found = []
    for top in range(0, -(-height // factor), side):
        for left in range(0, -(-width // factor), side):
            x, y = left * factor, top * factor
            w, h = min(side * factor, width - x), min(side * factor, height - y)
            size = -(-w // factor), -(-h // factor)
            region = "full" if (x, y, w, h) == (0, 0, width, height) else f"{x},{y},{w},{h}"
            named = "max" if region == "full" and size == (width, height) else f"{size[0]},{size[1]}"
            found.append((f"{region}/{named}/0/default.jpg", (left, top, *size)))
    return found


@given(width=SIDES, height=SIDES)
@settings(max_examples=12)
def test_every_request_that_a_viewer_makes_has_its_file(width, height) -> None:
    info = json.loads(encode_info(ADDRESS, width, height))
    files = dict(encode_tiles(image(width, height)))
    named = {f"full/{size['width']},{size['height']}/0/default.jpg" for size in info["sizes"]}
    asked = {path for factor in info["tiles"][0]["scaleFactors"] for path, _ in requested(info, factor)}
    assert asked | named | {"full/max/0/default.jpg"} == files.keys()


def test_the_tiles_of_every_level_are_the_page() -> None:
    page = np.kron(picture(1), np.ones((2, 2, 1), np.uint8))
    info = json.loads(encode_info(ADDRESS, page.shape[1], page.shape[0]))
    files = dict(encode_tiles(page))
    for factor in info["tiles"][0]["scaleFactors"]:
        size = -(-page.shape[1] // factor), -(-page.shape[0] // factor)
        expected = np.asarray(Image.fromarray(page).resize(size, Image.Resampling.LANCZOS), float)
        found = np.full_like(expected, np.nan)
        for path, (left, top, width, height) in requested(info, factor):
            tile = decoded(files[path])
            assert tile.shape[:2] == (height, width)
            found[top : top + height, left : left + width] = tile
        assert np.sqrt(np.mean((found - expected) ** 2)) < LEVELS  # NaN where no tile is would fail


@pytest.mark.parametrize("size", [(1, 1), (TILE, TILE), (TILE + 1, 3), (1600, 2400)])
def test_reductions_end_at_one_tile(size) -> None:
    factors = scale_factors(*size)
    assert factors == [2**k for k in range(len(factors))]
    assert max(-(-side // factors[-1]) for side in size) <= TILE
    assert len(factors) == 1 or max(-(-side // factors[-2]) for side in size) > TILE


def test_the_information_is_that_of_level_0() -> None:
    info = json.loads(encode_info(ADDRESS, 1600, 2400))
    assert info["@context"] == "http://iiif.io/api/image/3/context.json"
    assert (info["type"], info["protocol"], info["profile"]) == ("ImageService3", "http://iiif.io/api/image", "level0")
    assert info["sizes"][-1] == {"width": 800, "height": 1200}


@pytest.fixture
def manifest(volume) -> bytes:
    images = [PageImage(page, f"images/{page.number:04}", 650, 827, 150.0) for page in volume.pages[:2]]
    return encode_manifest(volume, images, ADDRESS)


def test_the_manifest_is_valid(manifest) -> None:
    prezi = pytest.importorskip("iiif_prezi3", reason="needs iiif-prezi3, the models of the published schema")
    read = prezi.Manifest.model_validate_json(manifest)
    assert len(read.items) == 2
    assert read.items[0].items[0].items[0].body.service[0].type == "ImageService3"


@pytest.mark.parametrize("broken", ["type", "label", "items", "id"])
def test_what_the_schema_wants_is_noticed(manifest, broken) -> None:
    prezi = pytest.importorskip("iiif_prezi3", reason="needs iiif-prezi3, the models of the published schema")
    value = json.loads(manifest)
    value[broken] = 7
    with pytest.raises(ValueError, match=broken):
        prezi.Manifest.model_validate_json(json.dumps(value))


def test_addresses_are_unique_and_below_that_of_the_folder(manifest) -> None:
    found: list[str] = []

    def walk(value) -> None:
        if isinstance(value, dict):
            if value.get("type") in ("Manifest", "Canvas", "AnnotationPage", "Annotation"):
                found.append(value["id"])
            for one in value.values():
                walk(one)
        elif isinstance(value, list):
            for one in value:
                walk(one)

    walk(json.loads(manifest))
    assert len(found) == len(set(found)) == 7
    assert all(address.startswith(f"{ADDRESS}/") for address in found)


def test_pages_have_their_labels_and_the_book_its_behaviour(manifest, volume) -> None:
    value = json.loads(manifest)
    assert [canvas["label"] for canvas in value["items"]] == [{"none": ["1r"]}, {"none": ["1v"]}]
    assert value["behavior"] == ["paged"]
    assert value["label"] == {"none": [volume.title]}
    loose = [PageImage(Page(1, "1", ()), "images/0001", 10, 10, 150.0)]
    assert json.loads(encode_manifest(volume, loose, ADDRESS))["behavior"] == ["individuals"]


@pytest.mark.parametrize("text", ["http://localhost:8000", "https://example.org/a%20b/", "http://[::1]:80/x"])
def test_an_address_of_a_folder_has_no_slash_at_its_end(text) -> None:
    assert folder_address(text) == text.rstrip("/")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "nonsense",
        "example.org/x",
        "ftp://x",
        "http://",
        "http://a b/c",
        "http://x:y",
        "http://[x",
        "http://x?b#c",
        "http://x/?",
    ],
)
def test_an_invalid_address_of_a_folder_is_refused(text) -> None:
    with pytest.raises(UsageError, match=r"^--url: .* is not an address"):
        folder_address(text)
