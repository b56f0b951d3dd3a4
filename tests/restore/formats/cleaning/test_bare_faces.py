"""Faces without texture coordinates."""

import numpy as np
import pytest

from restore.formats.cleaning.bare_faces import kept_faces


@pytest.mark.parametrize("bare, kept", [([0, 0, 0], [1, 1, 1]), ([0, 1, 0], [1, 0, 1]), ([1, 1, 0], [1, 1, 1])])
def test_the_fewer_are_left_out(bare, kept):
    found, findings = kept_faces(np.array(bare, bool))
    assert found.tolist() == [bool(k) for k in kept]
    assert len(findings) == any(bare)
