"""Pages of running text with the same margins, lines and title: the same one is told from the others."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from drivers.simulated import Text
from restore.scan import Bytes
from station.session.terms.presets import load_preset
from station.verdict.same_page import fingerprint, similarity

PAGE_MM = (148.0, 210.0)
SEEDS = (31, 32, 33)


def page(seed: int) -> Bytes:
    return np.array(Text(title_pt=20, sizes_pt=(11,), seed=seed, dpi=100).print_on(PAGE_MM).image)


def shot_again(image: Bytes, seed: int) -> Bytes:
    """A page turned by a third of a degree and moved by half a millimetre, under a lamp on the other side."""
    random, (height, width) = np.random.default_rng(seed), image.shape[:2]
    turn = cv2.getRotationMatrix2D((width / 2, height / 2), 0.33, 1.002)
    turn[:, 2] += 2
    moved = cv2.warpAffine(image, turn, (width, height), borderValue=(235, 235, 235)).astype(float)
    moved *= np.linspace(0.6, 0.95, width)[None, :, None]
    return np.clip(cv2.GaussianBlur(moved, (0, 0), 1.0) + random.normal(0, 2, moved.shape), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def pages() -> list[Bytes]:
    return [page(seed) for seed in SEEDS]


def test_a_page_is_like_itself_and_unlike_the_others(pages) -> None:
    amber, _ = load_preset("book").thresholds.similarity or (0.0, 0.0)
    again = [fingerprint(shot_again(image, seed)) for seed, image in enumerate(pages)]
    for one, image in enumerate(pages):
        alike = [similarity(fingerprint(image), other) for other in again]
        assert alike[one] > amber
        assert max(alike[:one] + alike[one + 1 :]) < amber


def test_a_blank_page_is_like_no_other(pages) -> None:
    random = np.random.default_rng(4)
    blank = fingerprint(np.clip(random.normal(230, 2, pages[0].shape), 0, 255).astype(np.uint8))
    assert similarity(blank, blank) == 0.0
    assert similarity(blank, fingerprint(pages[0])) == 0.0


def test_a_page_is_wholly_like_its_own_fingerprint(pages) -> None:
    print_of = fingerprint(pages[0])
    assert similarity(print_of, print_of) == pytest.approx(1.0, abs=1e-5)
