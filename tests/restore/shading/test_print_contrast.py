"""A gain that lowers the contrast of print is found."""

import numpy as np
import pytest

from restore.shading.print_contrast import loses_print

PAPER, INK = 0.7, 0.1
SHAPE = (120, 180)


def page():
    """Lines of strokes two cells wide, (r, c, 3)."""
    rows, cols = np.indices(SHAPE)
    ink = (rows % 8 < 3) & (cols % 5 < 2)
    return np.repeat(np.where(ink, INK, PAPER)[..., None], 3, axis=2).astype(np.float32)


def light():
    """Light that falls to a third from the left to the right."""
    return np.broadcast_to(np.linspace(1.0, 0.3, SHAPE[1], dtype=np.float32)[None, :, None], (*SHAPE, 3))


@pytest.mark.parametrize(("level", "lost"), [(1.0, False), (8.0, True)])
def test_only_a_gain_that_drives_paper_and_strokes_to_white_loses_print(level, lost):
    inside = np.ones(SHAPE, bool)
    assert loses_print(page() * light(), level / light(), inside) is lost


def test_a_dark_line_of_the_light_may_go():
    dark = np.ones((*SHAPE, 3), np.float32)
    dark[:, 90:93] = 0.5
    blank = np.full((*SHAPE, 3), PAPER, np.float32)
    assert not loses_print(blank * dark, 1 / dark, np.ones(SHAPE, bool))
