"""Ragged outlines of pages whose true sides are known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from restore.mesh.measures import flipped_faces
from restore.mesh.topology import Topology
from restore.mesh.triangulate import lattice
from restore.outline.sides import MAX_SHIFT, _update_grid_positions, straighten
from restore.range_image.facets.sheet import PageOnGrid, Sheet
from restore.scan import Floats, Ints

STRIDE = 4  # samples, as the fine mesh of a page
LOST_FRACTION = 0.08  # of the samples on the border
# Samples: an outline midway between samples is off by half of one at most, evenly spread; a line through fifty points
# of it by 0.29 / √50, four times that at worst; and lost samples draw it in by their share of a sample.
SIDE_SAMPLES = 0.16 + LOST_FRACTION
PAGES = 100
MEAN_SAMPLES = 0.02  # of sides of 100 samples four standard errors are 4 · 0.29 / √(100 · 100); 0.04 by vertices
EACH_SAMPLES = 0.012  # rms; the crossings in the mean tell it to 0.018
PICTURE_SAMPLES = 0.03  # codes are whole numbers, and a pixel's share of the paper is told to one in 180
EXACT_MM = 1e-6  # the page lies in a plane before the scanner: grid, surface and flat page are alike but for rounding

LEFT, TOP, RIGHT, BOTTOM = 14.3, 12.8, 183.6, 146.1  # sides in samples of the camera's 160 × 200


@dataclass(frozen=True, eq=False)
class Page:
    """A flat page cut out of a plane before the scanner."""

    sheet: Sheet
    mesh: PageOnGrid

    def straight(self) -> Page:
        return Page(self.sheet, straighten(self.sheet, self.mesh))

    @property
    def nodes(self):
        return self.mesh.nodes

    @property
    def box(self):
        """Left, top, right and bottom in samples."""
        top, left = self.nodes.min(axis=0)
        bottom, right = self.nodes.max(axis=0)
        return np.array([left, top, right, bottom])


def cut(camera, inside):
    sheet = camera.sheet(camera.facets(camera.plane()), inside)
    nodes, faces = lattice(inside, STRIDE)
    return Page(sheet, PageOnGrid(sheet.points(nodes)[:, :2], faces, nodes))


def rectangle(camera, left=LEFT, top=TOP, right=RIGHT, bottom=BOTTOM):
    rows, cols = camera.indices
    return (cols > left) & (cols < right) & (rows > top) & (rows < bottom)


def gnawed(inside, seed=0):
    """The mask without some samples on its border, as a scanner loses them."""
    ring = inside & ~(np.roll(inside, 1, 0) & np.roll(inside, -1, 0) & np.roll(inside, 1, 1) & np.roll(inside, -1, 1))
    return inside & ~(ring & (np.random.default_rng(seed).random(inside.shape) < LOST_FRACTION))


sides = st.tuples(st.floats(12, 16), st.floats(10, 14), st.floats(180, 186), st.floats(142, 148))


# Turned by half a degree, a side crosses from one row of samples to the next, and its outline has all of their errors.
@settings(deadline=None, max_examples=15)
@example((12.0, 10.0, 181.5, 142.0), 0.5, 1)  # the right side loses samples above more than below
@given(sides, st.floats(0.5, 3.0), st.sampled_from([-1, 1]))
def test_the_border_of_a_ragged_page_is_on_its_true_sides(camera, box, turn_deg, way):
    cos, sin = np.cos(np.radians(turn_deg)), way * np.sin(np.radians(turn_deg))
    rows, cols = camera.indices
    x, y = cols - 99.5, rows - 79.5
    x, y = x * cos - y * sin + 99.5, x * sin + y * cos + 79.5
    inside = (x > box[0]) & (x < box[2]) & (y > box[1]) & (y < box[3])
    page = cut(camera, gnawed(inside))
    turned = page.mesh.flat @ np.array([[cos, -sin], [sin, cos]])  # y of the page is up
    straight = Page(page.sheet, replace(page.mesh, flat=turned)).straight()
    size = np.ptp(straight.mesh.flat, axis=0) / camera.pitch_mm
    np.testing.assert_allclose(size, [box[2] - box[0], box[3] - box[1]], atol=2 * SIDE_SAMPLES)
    assert flipped_faces(straight.mesh.flat, straight.mesh.faces) == 0


@pytest.mark.slow
def test_turned_pages_have_their_true_size(camera):
    random, off = np.random.default_rng(3), []
    rows, cols = camera.indices
    for _ in range(PAGES):
        angle, width, height = np.radians(random.uniform(1.0, 4.0)), random.uniform(159, 161), random.uniform(119, 121)
        shift = random.uniform(-0.5, 0.5, 2)
        cos, sin = np.cos(angle), np.sin(angle)
        x, y = cols - 99.5 - shift[0], rows - 79.5 - shift[1]
        x, y = x * cos - y * sin, x * sin + y * cos
        page = cut(camera, (np.abs(x) < width / 2) & (np.abs(y) < height / 2))
        flat = page.mesh.flat @ np.array([[cos, -sin], [sin, cos]])
        straight = straighten(page.sheet, replace(page.mesh, flat=flat))
        off.append(np.ptp(straight.flat, axis=0) / camera.pitch_mm - [width, height])
    assert np.abs(np.mean(off, axis=0)).max() < MEAN_SAMPLES
    assert np.sqrt(np.mean(np.square(off))) < EACH_SAMPLES


def test_the_whole_outline_is_on_the_sides_and_reaches_the_corners(camera):
    page = cut(camera, gnawed(rectangle(camera)))
    straight = page.straight()
    np.testing.assert_allclose(straight.box, [LEFT, TOP, RIGHT, BOTTOM], atol=SIDE_SAMPLES + 0.5)  # no row is cut
    flat = straight.mesh.flat
    outline = flat[Topology(straight.mesh.faces).border]
    low, high = flat.min(axis=0), flat.max(axis=0)
    off = np.minimum(np.abs(outline - low), np.abs(outline - high)).min(axis=1)
    assert (off < EXACT_MM).mean() > 0.95  # beside a corner, some stay where they were
    for corner in (low, high, [low[0], high[1]], [high[0], low[1]]):
        assert np.linalg.norm(outline - corner, axis=1).min() < EXACT_MM


def pictured(camera, page, box, *, table=40.0, noise=1.5):
    """The page, cut out of a mesh, in a picture of paper between the left, top, right and bottom of a box, samples."""
    rows, cols = camera.indices
    paper = np.clip(cols - box[0] + 0.5, 0, 1) * np.clip(box[2] - cols + 0.5, 0, 1)
    paper = paper * np.clip(rows - box[1] + 0.5, 0, 1) * np.clip(box[3] - rows + 0.5, 0, 1)
    light = table + (220.0 - table) * paper + np.random.default_rng(0).normal(0.0, noise, paper.shape)
    texture = np.repeat(np.rint(light)[..., None], 3, axis=2).astype(np.uint8)
    sheet = replace(page.sheet, scan=replace(page.sheet.scan, texture=texture), cut_out=True)
    return Page(sheet, page.mesh)


@pytest.mark.parametrize("beyond", [0.2, 0.5, 0.9, 1.2])
def test_a_page_cut_out_of_a_mesh_reaches_the_edge_in_its_picture(camera, beyond):
    box = np.array([LEFT - beyond, TOP - beyond, RIGHT + beyond, BOTTOM + beyond])
    page = pictured(camera, cut(camera, gnawed(rectangle(camera))), box)
    np.testing.assert_allclose(page.straight().box, box, atol=PICTURE_SAMPLES)


def test_a_page_cut_out_of_a_mesh_ends_with_it_where_its_picture_shows_no_edge(camera):
    page = cut(camera, rectangle(camera))
    shown = pictured(camera, page, np.array([LEFT, TOP, RIGHT, BOTTOM]) + [-6.0, -6.0, 6.0, 6.0])
    np.testing.assert_array_equal(shown.straight().box, page.straight().box)


def test_the_end_of_an_atlas_is_not_an_edge_of_paper(camera):
    """An atlas is padded beyond its mesh, here by 0.8 pixels, and the rest of it is empty."""
    page = cut(camera, rectangle(camera))
    box = np.array([LEFT, TOP, RIGHT, BOTTOM]) + [-0.8, -0.8, 0.8, 0.8]
    padded = pictured(camera, page, box, table=0.0, noise=0.0)
    np.testing.assert_array_equal(padded.straight().box, page.straight().box)


def test_a_scrap_that_hangs_from_a_page_of_a_mesh_turns_no_side(camera):
    inside = rectangle(camera)
    inside[100:104, int(RIGHT) + 1 : int(RIGHT) + 6] = True
    box = np.array([LEFT, TOP, RIGHT, BOTTOM])
    page = pictured(camera, cut(camera, inside), box).straight()
    on_side = np.abs(page.nodes[:, 1] - RIGHT) < PICTURE_SAMPLES
    assert on_side.sum() > 0.8 * (BOTTOM - TOP) / STRIDE


def test_vertices_match_their_grid_positions(camera):
    page = cut(camera, gnawed(rectangle(camera))).straight()
    mesh, sheet = page.mesh, page.sheet
    np.testing.assert_allclose(sheet.points(mesh.nodes)[:, :2], mesh.flat, atol=EXACT_MM)
    assert set(np.unique(mesh.faces)) == set(range(len(mesh.flat)))


def tongue(camera):
    inside = rectangle(camera)
    inside[60:90, 8:20] = True  # a slip of paper sticks out on the left
    return inside


def dent(camera):
    inside = rectangle(camera)
    rows, cols = camera.indices
    inside[(cols < LEFT + 8) & (rows > 40) & (rows < 100)] = False
    return inside


def bow(camera):
    rows, cols = camera.indices
    return rectangle(camera, left=0) & (cols > LEFT + 5 * ((rows - 79.5) / 67) ** 2)


@pytest.mark.parametrize("outline", [tongue, dent, bow])
def test_a_side_that_is_not_straight_is_left_unchanged(camera, outline):
    page = cut(camera, outline(camera))
    straight = page.straight()
    assert straight.box[0] == page.box[0]

    def left(one):
        return one.nodes[(one.nodes[:, 1] < 30) & (np.abs(one.nodes[:, 0] - 79.5) < 60)]

    np.testing.assert_array_equal(left(straight), left(page))
    np.testing.assert_allclose(straight.box[2], RIGHT, atol=SIDE_SAMPLES + 0.5)


def test_an_oblique_side_stays_oblique(camera):
    rows, cols = camera.indices
    slope = 4 / (BOTTOM - TOP)
    page = cut(camera, gnawed(rectangle(camera, left=0) & (cols > LEFT + slope * (rows - TOP))))
    straight = page.straight()
    side = straight.nodes[Topology(straight.mesh.faces).border]
    side = side[(side[:, 1] < 25) & (side[:, 0] > TOP + STRIDE) & (side[:, 0] < BOTTOM - STRIDE)]
    off = np.abs(side[:, 1] - (LEFT + slope * (side[:, 0] - TOP)))
    assert len(side) > 20
    assert np.sort(off)[-2] < SIDE_SAMPLES  # one is the bottom of a notch that lost samples left


def test_the_border_moves_by_no_more_than_the_scanners_error(camera):
    page = cut(camera, gnawed(rectangle(camera)))
    before, after = page.nodes[Topology(page.mesh.faces).border], page.straight().nodes
    far = np.abs(before[:, None] - after[None]).max(axis=2).min(axis=1)
    assert np.sort(far)[-9] <= MAX_SHIFT  # two at a corner go farther, or are gone with what lay beyond


def test_a_page_that_is_not_rectangular_is_left_unchanged(camera):
    rows, cols = camera.indices
    page = cut(camera, np.hypot(cols - 99.5, rows - 79.5) < 60)
    assert page.straight().mesh is page.mesh


def test_a_scrap_of_the_table_that_hangs_from_a_page_of_a_mesh_is_removed(camera):
    """And a tab of paper is not: the picture tells them apart."""
    inside = rectangle(camera)
    inside[95:110, int(RIGHT) + 1 : int(RIGHT) + 9] = True
    box = np.array([LEFT, TOP, RIGHT, BOTTOM])
    page = pictured(camera, cut(camera, inside), box)
    assert page.straight().nodes[:, 1].max() < RIGHT + 1.0
    tab = page.sheet.scan.texture.copy()
    tab[94:111, int(RIGHT) : int(RIGHT) + 10] = 220
    kept = Page(replace(page.sheet, scan=replace(page.sheet.scan, texture=tab)), page.mesh)
    assert kept.straight().nodes[:, 1].max() > RIGHT + 6.0


class Wall:
    """A plane of one millimetre for each sample; farthest, the position farthest off that was asked for."""

    inside = np.ones((20, 20), bool)
    farthest = 0.0

    def lengths(self, nodes, edges):
        self.farthest = max(self.farthest, float(np.abs(nodes).max()))
        return np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1)


@dataclass(frozen=True)
class Moved:
    """A sheet whose border moved on the page, and Jacobians that are too large, as those of a steep wall are."""

    nodes: Floats
    after: Floats
    edges: Ints
    jacobians: Floats

    @classmethod
    def by(cls, overshoot):
        nodes, faces = lattice(Wall.inside, STRIDE)
        edges, border = Topology(faces).edges, Topology(faces).border
        after, jacobians = nodes.copy(), np.zeros((len(nodes), 2, 2))
        after[border] += np.random.default_rng(1).normal(0.0, 0.3, (len(border), 2))
        jacobians[border] = overshoot * np.eye(2)
        return cls(nodes, after, edges, jacobians)

    def found(self, wall):
        return _update_grid_positions(wall, self.nodes, self.jacobians, self.nodes, self.after, self.edges)

    def missed(self, places):
        start, end = self.after[self.edges].swapaxes(0, 1)
        return (np.linalg.norm(end - start, axis=1) - Wall().lengths(places, self.edges)) ** 2


@pytest.mark.parametrize("overshoot", [1.0, 3.0])
def test_moved_vertices_never_miss_their_edges_by_more_than_at_first(overshoot):
    moved = Moved.by(overshoot)
    first = moved.nodes + overshoot * (moved.after - moved.nodes)
    # A vertex keeps its own best place while its neighbours move to theirs: twice as far off is more than any of that.
    assert moved.missed(moved.found(Wall())).sum() < 2.0 * moved.missed(first).sum() + 1e-12


def test_no_length_is_measured_far_beyond_the_image():
    """A path is followed sample by sample: one to a position that diverged would not end."""
    wall = Wall()
    assert np.isfinite(Moved.by(1e4).found(wall)).all()
    assert wall.farthest <= 2 * max(Wall.inside.shape)
