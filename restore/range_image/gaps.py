"""Gaps in the rows of a mask: samples that were not measured between two that were."""

from __future__ import annotations

import numpy as np

from restore.scan import Ints, Mask


def gaps_of_rows(measured: Mask) -> tuple[Ints, Ints]:
    """Return the samples before and behind each gap in the rows of a mask.

    measured: (rows, cols). Returns the last sample (g,) before each gap and the first (g,) behind it, as indices into
        the flattened mask.
    """
    samples = np.flatnonzero(measured)
    gap = np.flatnonzero(np.diff(samples) > 1)
    last, following = samples[gap], samples[gap + 1]
    in_one_row = last // measured.shape[1] == following // measured.shape[1]
    return last[in_one_row], following[in_one_row]
