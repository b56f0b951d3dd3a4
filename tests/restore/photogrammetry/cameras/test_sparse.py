"""What cannot be one set of photographs is refused, with its reason."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from restore import Photograph
from restore.photogrammetry.cameras.sparse import check_one_lens, reconstruct
from restore.photogrammetry.errors import ExtraMissing, MixedLenses, TooFewViews
from restore.photogrammetry.reconstruct import reconstruct_page

GREY = np.full((300, 400, 3), 128, np.uint8)


def named(name, image=GREY, focal=None) -> Photograph:
    return Photograph(image, name, focal)


def test_two_sizes_are_two_cameras():
    with pytest.raises(MixedLenses, match="one has 400 × 300 pixels and two 300 × 400") as fault:
        check_one_lens([named("one"), named("two", GREY.transpose(1, 0, 2))])
    assert fault.value.exit_code == 3


def test_two_focal_lengths_are_two_lenses():
    with pytest.raises(MixedLenses, match="one and three were taken at different focal lengths"):
        check_one_lens([named("one", focal=300.0), named("two"), named("three", focal=600.0)])
    check_one_lens([named("one", focal=300.0), named("two", focal=301.0)])


def test_two_photographs_are_too_few():
    with pytest.raises(TooFewViews, match="2 photographs are too few") as fault:
        reconstruct_page([named("one"), named("two")])
    assert fault.value.exit_code == 5


def test_without_the_extra_its_name_is_given(monkeypatch):
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    with pytest.raises(ExtraMissing, match="pycolmap") as fault:
        reconstruct([named("one")] * 3, lambda stage, done: None)
    assert "planish[photos]" in fault.value.hint
    assert fault.value.exit_code == 2


def test_the_process_still_hears_that_it_is_to_end():
    pytest.importorskip("pycolmap")
    program = (
        "import os, signal, sys\n"
        "from restore.photogrammetry.cameras.sparse import _colmap\n"
        "signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(7))\n"
        "_colmap()\n"
        "os.kill(os.getpid(), signal.SIGTERM)\n"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (7, "")


def test_blank_photographs_do_not_join():
    pytest.importorskip("pycolmap")
    rng = np.random.default_rng(1)
    print_ = np.repeat(rng.integers(0, 256, (300, 400, 1), np.uint8), 3, axis=2)
    with pytest.raises(TooFewViews, match=r"0 of 3 photographs join .* blank: it is blank") as fault:
        reconstruct([named("one", print_), named("two", print_[::-1]), named("blank")], lambda stage, done: None)
    assert "degrees" in fault.value.hint
