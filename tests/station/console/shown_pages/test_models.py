"""Arrays for the 3D view and the ruler, against surfaces whose lengths are known exactly."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restore import FlatMesh
from station.console.faults import ConsoleFault
from station.console.shown_pages.models import Ruler, grid_faces
from station.console.shown_pages.tiles import Pyramids, build_pyramid
from station.page_files.model import decode_arrays, encode_arrays
from tests.station.conftest import HEIGHT_MM, RADIUS_MM, WIDTH_MM, curl_mesh, curl_scan

# Chords of the stand-in's 23 facets instead of the arc: (s / r)² / 24 of each facet of 5.2 mm on 60 mm, and the map's
# linear interpolation at its border.
FACETS = 2e-3


def ruler_on(mesh: FlatMesh) -> Ruler:
    """A ruler on the picture of a page that is not cropped."""
    places = (mesh.flat - [mesh.flat[:, 0].min(), mesh.flat[:, 1].max()]) * [1.0, -1.0]
    return Ruler(mesh.vertices, places, mesh.faces, tuple(places.max(axis=0)))


@pytest.fixture(scope="module")
def ruler() -> Ruler:
    return ruler_on(curl_mesh(curl_scan()))


def test_lengths_on_a_cylinder(ruler):
    assert ruler.size_mm == pytest.approx((WIDTH_MM, HEIGHT_MM))
    across = ruler.measure((10, 40), (110, 40))
    assert across["page_mm"] == 100.0
    assert across["sheet_mm"] == pytest.approx(100.0, rel=FACETS)
    assert across["chord_mm"] == pytest.approx(2 * RADIUS_MM * math.sin(100 / (2 * RADIUS_MM)), rel=FACETS)
    down = ruler.measure((60, 5), (60, 75))
    assert down["sheet_mm"] == pytest.approx(70.0, rel=FACETS)
    assert down["chord_mm"] == pytest.approx(70.0, rel=FACETS)


@given(*(st.floats(2, 118) for _ in range(2)), *(st.floats(2, 78) for _ in range(2)))
def test_a_path_on_the_sheet_is_at_least_as_long_as_through_space_and_the_same_back(x0, x1, y0, y1):
    ruler = ruler_on(curl_mesh(curl_scan()))
    there, back = ruler.measure((x0, y0), (x1, y1)), ruler.measure((x1, y1), (x0, y0))
    assert there["sheet_mm"] >= there["chord_mm"] - 1e-9
    assert there["sheet_mm"] == pytest.approx(back["sheet_mm"])
    assert there["sheet_mm"] == pytest.approx(there["page_mm"], rel=FACETS, abs=0.02)


@pytest.mark.parametrize("point", [(-5, 40), (125, 40), (60, -5), (60, 85)])
def test_off_the_page_nothing_is_measured(ruler, point):
    with pytest.raises(ConsoleFault, match="next to the page"):
        ruler.measure((60, 40), point)


def test_triangles_of_a_grid_join_neighbours_that_were_measured():
    measured = np.ones((3, 4), bool)
    assert len(grid_faces(measured)) == 2 * 2 * 3
    measured[1, 1] = False
    faces = grid_faces(measured)
    assert faces.max() == measured.sum() - 1
    assert len(faces) == 12 - 6


@given(st.dictionaries(st.text(min_size=1, max_size=9), st.tuples(st.integers(0, 5), st.integers(1, 3)), max_size=4))
def test_arrays_come_back_as_they_were(shapes):
    arrays = {
        name: np.arange(math.prod(shape)).reshape(shape).astype(np.float32 if i % 2 else np.uint32)
        for i, (name, shape) in enumerate(shapes.items())
    }
    data = encode_arrays(arrays, {"ä": 1.5})
    found, facts = decode_arrays(data)
    assert facts == {"ä": 1.5}
    assert all(np.array_equal(found[name], array) for name, array in arrays.items())
    assert int.from_bytes(data[4:8], "little") % 4 == 0


@pytest.mark.parametrize("data", [b"", b"PLM1", b"PLM2\0\0\0\0", b"PLM1\xff\xff\xff\xff{}", b"PLM1\x02\0\0\0[]"])
def test_what_is_not_a_model_is_refused(data):
    with pytest.raises(ValueError, match=r"model|valid"):
        decode_arrays(data)


@given(st.integers(1, 700), st.integers(1, 700))
def test_levels_halve_down_to_a_pixel(width, height):
    pyramid = build_pyramid(np.zeros((height, width, 3), np.uint8))
    assert len(pyramid.levels) == math.ceil(math.log2(max(width, height))) + 1
    assert pyramid.levels[0].shape[:2] == (1, 1)
    assert pyramid.size == (width, height)
    assert pyramid.sizes == [level.shape[1::-1] for level in pyramid.levels]
    for below, above in zip(pyramid.levels, pyramid.levels[1:], strict=False):
        assert below.shape[:2] == tuple(math.ceil(side / 2) for side in above.shape[:2])


def test_pyramids_are_kept_within_a_limit_the_oldest_goes():
    made = []

    def picture(name):
        made.append(name)
        return np.zeros((64, 64, 3), np.uint8)

    kept = Pyramids(limit=2 * build_pyramid(picture("")).nbytes)
    for name in ("a", "b", "a", "c", "a", "b"):
        kept.get(name, lambda name=name: build_pyramid(picture(name)))
    assert made == ["", "a", "b", "c", "b"]
    assert kept.nbytes <= 2 * build_pyramid(picture("")).nbytes
