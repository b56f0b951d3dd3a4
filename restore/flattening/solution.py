"""What every flattening method returns, and what it may call after each of its steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from restore.scan import Floats

Follow = Callable[[int, Floats], None]
"""Called after each step with its number and the positions (n, 3) mm."""


class Solution(NamedTuple):
    """Flat positions (n, 2) mm of one connected piece, and how the solver got there.

    iterations  steps that it took.
    residual    rms strain that a single vertex could still be relieved of; 0 for a method with one linear solve.
    converged   whether the residual, or the change in the last step, fell below the solver's tolerance.
    """

    flat: Floats
    iterations: int
    residual: float = 0.0
    converged: bool = True

    @property
    def convergence(self) -> dict[str, float | bool]:
        """`residual` and `converged` by their names, as `FlatMesh` has them."""
        return {"residual": self.residual, "converged": self.converged}

    def joined(self, other: Solution) -> Solution:
        """Return this solution with the greater figures of another.

        The two were solved separately.
        """
        worst = max(self.iterations, other.iterations), max(self.residual, other.residual)
        return Solution(self.flat, *worst, self.converged and other.converged)
