"""The report of a page whose strain, size and holes are known."""

import json
from dataclasses import replace

import numpy as np
import pytest

from restore.mesh.topology import Topology
from restore.mesh.triangulate import lattice
from restore.page import FlatMesh
from restore.prepared.description import NOT_DEVELOPABLE, describe, findings_of_page
from restore.prepared.facet_sheet import FacetSheet
from restore.prepared.plain_mesh import PlainMesh
from restore.prepared.prepared import Unrolled
from restore.runtime.rows import Rows
from restore.settings import Settings
from restore.texture.page import Painting
from restore.texture.resolution import Resolution

SINGLE = 1e-6  # relative


@pytest.fixture
def page():
    """A page of 120 × 80 mm, stretched by half a per cent across: flat it is longer."""
    nodes, faces = lattice(np.ones((41, 61), bool), 4)
    upright = nodes[:, ::-1] * [1, -1]
    surface = (upright - upright.min(axis=0)) / np.ptp(upright, axis=0) * [120.0, 80.0]
    edges = Topology(faces).edges
    vertices = np.column_stack([surface, np.full(len(surface), -900.0)])
    lengths = np.linalg.norm(np.diff(surface[edges], axis=1)[:, 0], axis=1)
    return FlatMesh(
        vertices,
        faces,
        surface,
        np.zeros((9, 9, 3), np.uint8),
        flat=surface * [1.005, 1.0],
        lengths=lengths,
        iterations=57,
    )


def described(fine, *, surface=None, settings=None, distance=None):
    coarse = replace(fine, vertices=fine.vertices[:50], flat=fine.flat[:50])
    image = np.zeros((4, 5, 3), np.uint8)
    painting = Painting(image, image[..., 0] == 0, Rows.of(np.zeros((4, 5, 2), np.float32)), Resolution(141.5, 0.25))
    prepared = PlainMesh(fine) if surface is None else FacetSheet(surface)
    report = describe(
        prepared, Unrolled(coarse, fine, np.empty((0, 2)), distance or {}), painting, settings or Settings()
    )
    found = [*findings_of_page(fine, report["strain"]), *prepared.findings]
    return report | {"findings": [one.as_json() for one in found]}


def test_a_page_that_is_folded_over_itself_is_reported(page):
    across = page.flat[:, 0]
    folded = replace(page, flat=np.column_stack([np.where(across > 90.0, 180.0 - across, across), page.flat[:, 1]]))
    assert any("of the faces are flipped" in one["text"] for one in described(folded)["findings"])


def test_the_report_holds_the_options_and_the_measures(page):
    settings = Settings(points=500, dpi=200, shading="remove")
    report = described(page, settings=settings, distance={"mean_mm": 0.1, "sd_mm": 0.2, "max_mm": 0.3})
    assert json.loads(json.dumps(report)) == report
    assert {key: report[key] for key in ("method", "dpi", "shading")} == settings.model_dump(
        exclude={"points", "inpaint_mm", "white_balance", "uncertainty"}
    )
    assert report["points"] == 50
    assert report["iterations"] == 57
    assert (report["sampling_ppi"], report["resolved_ppi"]) == (141.5, 141.5 / 2)
    assert report["decimation_error_mm"] == {"mean_mm": 0.1, "sd_mm": 0.2, "max_mm": 0.3}
    assert report["flipped_faces"] == 0
    assert report["area_ratio"] == pytest.approx(1.005, rel=SINGLE)
    np.testing.assert_allclose(report["page_mm"], [120.6, 80.0], rtol=SINGLE)
    assert report["findings"] == []


def test_strain_is_relative_to_the_lengths_on_the_surface(page):
    strain = described(page)["strain"]
    edges = Topology(page.faces).edges
    along = np.abs(np.diff(page.vertices[edges], axis=1)[:, 0, 0]) / page.lengths
    expected = np.sqrt(1 + (1.005**2 - 1) * along**2) - 1
    assert strain["max"] == pytest.approx(0.005, rel=SINGLE)
    assert strain["rms"] == pytest.approx(np.sqrt(np.mean(expected**2)), rel=SINGLE)
    assert described(replace(page, lengths=2 * page.lengths))["strain"]["max"] == pytest.approx(0.5, rel=SINGLE)


def test_single_wrong_lengths_are_not_a_stretch(page, rng):
    wrong = np.where(rng.random(len(page.lengths)) < 0.002, 1.3, 1.0)
    report = described(replace(page, lengths=wrong * page.lengths, flat=page.flat / [1.005, 1.0]))
    assert report["strain"]["rms"] > NOT_DEVELOPABLE > report["strain"]["smooth_rms"]
    assert report["findings"] == []


def test_a_flipped_face_is_counted(page):
    flat = page.flat.copy()
    corner = np.argmin(flat.sum(axis=1))
    flat[corner] = flat.mean(axis=0)
    assert described(replace(page, flat=flat))["flipped_faces"] >= 1


def test_a_stretched_sheet_is_reported_as_a_warning(page):
    (found,) = described(replace(page, flat=page.flat * (1 + 2 * NOT_DEVELOPABLE)))["findings"]
    assert "cannot be flattened without stretching" in found["text"]


@pytest.mark.parametrize("without", ["texture", "texcoords"])
def test_a_page_without_colour_is_reported_to_show_its_relief(page, without):
    (found,) = described(replace(page, **{without: None}))["findings"]
    assert "relief" in found["text"]


def test_the_filled_fraction_of_a_sheet_on_its_grid_is_reported(camera, page):
    inside = np.zeros(camera.shape, bool)
    inside[20:120, 30:130] = True
    sheet = camera.sheet(camera.facets(camera.plane()), inside)
    measured = inside.copy()
    measured[40:60, 50:100] = False
    report = described(page, surface=replace(sheet, measured=measured))
    assert report["samples"] == 9000
    assert report["interpolated_fraction"] == pytest.approx(0.1)
    assert "samples" not in described(page)


def test_paper_lost_at_the_border_is_warned_about(page, camera):
    sheet = camera.sheet(camera.facets(camera.plane()))
    (found,) = described(page, surface=replace(sheet, lost_border=0.05))["findings"]
    assert found["text"].startswith("along at least 5% of the page border")
    assert described(page, surface=sheet)["findings"] == []


def test_a_border_that_is_turned_away_is_warned_about(page, camera):
    sheet = camera.sheet(camera.facets(camera.plane()))
    (found,) = described(page, surface=replace(sheet, turned_border=0.05))["findings"]
    assert found["text"].startswith("along 5% of its border the page is tilted")


def test_strain_is_also_given_against_straight_lengths_with_how_far_the_estimates_differ(page):
    longer = replace(page, flat=page.flat, lengths=1.02 * page.lengths)
    chords = described(longer)["strain"]["chord_strain"]
    assert chords["estimate_rms"] == pytest.approx(0.02, rel=SINGLE)
    assert chords["max"] == pytest.approx(described(page)["strain"]["max"], rel=SINGLE)
    assert chords["rms"] == pytest.approx(described(page)["strain"]["rms"], rel=SINGLE)


def test_a_page_of_estimated_lengths_is_warned_about_with_the_place_of_the_largest_difference(page):
    edges = Topology(page.faces).edges
    lengths = np.where(np.arange(len(edges)) % 3 > 0, 1.05, 1.0) * page.lengths
    lengths[7] = 2.0 * page.lengths.max()
    report = described(replace(page, lengths=lengths))
    chords = report["strain"]["chord_strain"]
    assert chords["estimated_fraction"] == pytest.approx(2 / 3, abs=2 / len(edges))
    np.testing.assert_allclose(chords["max_difference_at_mm"], page.flat[edges[7]].mean(axis=0), rtol=SINGLE)
    assert any("67% of the edges" in one["text"] for one in report["findings"])
    assert not any("of the edges" in one["text"] for one in described(page)["findings"])


def test_convergence_and_faces_folded_in_space_are_reported(page):
    report = described(replace(page, residual=0.25, converged=False))
    assert report["convergence"] == {"converged": False, "residual": 0.25}
    assert report["folded_faces"] == 0
    vertices = page.vertices.copy()
    inner = int(np.argmin(np.linalg.norm(page.vertices - page.vertices.mean(axis=0), axis=1)))
    face = next(f for f in page.faces if inner in f)
    vertices[inner] += 1.5 * (vertices[face[face != inner]].mean(axis=0) - vertices[inner])
    assert described(replace(page, vertices=vertices))["folded_faces"] > 0
