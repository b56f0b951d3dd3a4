"""Limits of floating-point arithmetic.

They replace a divisor of zero and are far below every quantity that is divided by.
"""

from __future__ import annotations

import numpy as np

from restore.scan import Floats

# The variances of inverse depths are about 1e-18 mm⁻², their squares the least there is; a quotient with it stays
# finite for numerators up to 1e8.
TINY = 1e-300
SQUARE_TINY = 1e-30  # of what is squared again before it is divided by
SMALL = 1e-12  # of lengths in mm and their squares: particles at one place
SINGLE_PRECISION = 2.0**-23  # of a length: files of meshes hold no more digits
SINGLE_TINY = 1e-6  # of light, fractions and areas in pixels in single precision, whose least step near 1 is 1e-7

# Decorates what takes coordinates of any size: the infinity or NaN that it returns is looked for, as a kernel's is.
overflows_silently = np.errstate(over="ignore", invalid="ignore")


@overflows_silently
def sum_in_order(values: Floats) -> float:
    """Sum of values (n,), added one after the other.

    np.sum adds in pairs and groups, which rounds otherwise; compiled loops add in order.
    """
    return float(np.add.accumulate(values)[-1]) if len(values) else 0.0
