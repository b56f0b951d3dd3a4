"""A light is chosen by regions of constant print, and tells where their edges lie along creases."""

import numpy as np

from restore.numerics.limits import SINGLE_TINY
from restore.shading.channels import as_list
from restore.shading.estimate import CheckPlaces, estimate_again, estimate_light
from restore.shading.regions import regions_of
from restore.shading.relief import Relief
from restore.shading.surroundings import places_of, surroundings_of

FOLD_MM = 12.0
SLOPE = 0.5  # rise over run of a facet
GREY = 0.7  # of the paper: less than what a fold does to the light
NOISE = 0.01  # of the light
LEFT = 0.03  # of the light: what an estimate may leave


def folded(rows=160, cols=200, cell=0.42):
    """The relief of a page folded to and fro every FOLD_MM, and on which facets each cell lies."""
    x, y = np.meshgrid((np.arange(cols) - cols / 2) * cell, (rows / 2 - np.arange(rows)) * cell)
    facet = np.floor(x / FOLD_MM).astype(int)
    rising = facet % 2 == 0
    along = x / FOLD_MM - facet
    points = np.dstack([x, y, SLOPE * FOLD_MM * np.where(rising, along, 1 - along)])
    slope = np.where(rising, SLOPE, -SLOPE)
    normals = np.dstack([-slope, np.zeros_like(x), np.ones_like(x)]) / np.hypot(SLOPE, 1)
    k = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[:-1, 1:], k[1:, :-1], k[1:, 1:]))
    faces = np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)])
    fields = (field.astype(np.float32) for field in (points, normals))
    return Relief(*fields, 60.0, points.reshape(-1, 3), faces, np.eye(3), np.zeros(3))


def test_a_first_light_parts_print_from_paper_along_the_creases():
    """A grey field whose edges the folds cross is one region with the paper, until the light on the folds is known."""
    relief = folded()
    inside = np.ones(relief.points.shape[:2], bool)
    light = 0.4 + 0.6 * np.maximum(relief.normals @ np.float32([-0.5, 0.0, 0.87]), 0)
    reflectance = np.ones_like(light)
    reflectance[50:110, 40:160] = GREY
    noise = 1 + NOISE * np.random.default_rng(4).standard_normal((*light.shape, 3))
    colour = (0.8 * (reflectance * light)[..., None] * noise).astype(np.float32)
    regions = regions_of(colour, relief.normals, inside)
    assert regions.labels[80, 100] == regions.labels[20, 100]
    surroundings = surroundings_of(relief)
    places = places_of(relief, surroundings.horizon)
    paper = np.flatnonzero(reflectance == 1)
    checks = CheckPlaces.of(colour, regions, inside)
    first = estimate_light(as_list(colour), paper, places, surroundings, regions, checks, inside)
    again, checks = estimate_again(first, colour, relief.normals, paper, places, surroundings, inside)
    grey = reflectance.ravel()[checks.cells] < 1
    assert not set(checks.labels[grey]) & set(checks.labels[~grey])
    left = again.values.mean(axis=1) / np.maximum(light.ravel(), SINGLE_TINY)
    assert np.std(left / left.mean()) < LEFT
