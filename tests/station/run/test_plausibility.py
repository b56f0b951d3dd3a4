"""Surfaces that are no page."""

from __future__ import annotations

import json

import numpy as np
import pytest

from restore import NotEnoughSurface
from restore.formats import write_obj
from restore.scan import SurfaceMesh
from station.cli import main
from station.run.plausibility import MAX_INVERTED, MAX_STRAIN, check_plausible_page

FACES = 1000


def report(strain=0.0, inverted=0):
    return {"strain": {"rms": strain}, "flipped_faces": inverted}


@pytest.mark.parametrize("values", [(MAX_STRAIN, 0), (0.0, int(MAX_INVERTED * FACES)), (0.005, 3)])
def test_up_to_the_limits_a_surface_is_a_page(values):
    check_plausible_page(report(*values), FACES)


@pytest.mark.parametrize(("values", "figure"), [((0.87, 0), "87% rms"), ((0.01, 620), "620 of 1000")])
def test_beyond_a_limit_it_is_refused_with_the_figure(values, figure):
    with pytest.raises(NotEnoughSurface, match=figure) as raised:
        check_plausible_page(report(*values), FACES)
    assert "--allow-distorted" in raised.value.hint


def test_a_heap_of_triangles_is_written_on_request_alone(tmp_path, capsys):
    """27 vertices at random, joined at random."""
    rng = np.random.default_rng(0)
    write_obj(SurfaceMesh(rng.normal(0, 30, (27, 3)), rng.integers(0, 27, (40, 3))), tmp_path / "heap.obj")
    command = ["restore", str(tmp_path / "heap.obj"), "-o", str(tmp_path / "out"), "--dpi", "50"]
    assert main(command) == 5
    assert "the surface is not a page" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert main([*command, "--allow-distorted"]) == 0
    assert json.loads((tmp_path / "out" / "heap.json").read_text())["strain"]["rms"] > MAX_STRAIN
