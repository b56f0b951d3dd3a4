"""Pictures that are drawn by rows, so that none of them need be in memory whole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from restore.runtime.threads import in_picture_bands


@dataclass(frozen=True, eq=False)
class Rows:
    """A picture (h, w, …) that is drawn by rows. Called, it gives all of it.

    draw  gives the rows (rows, w, …) of a slice, in several threads at once.
    kept  the picture, where it is in memory.
    """

    shape: tuple[int, ...]
    dtype: DTypeLike
    draw: Callable[[slice], NDArray[Any]]
    kept: NDArray[Any] | None = None

    @classmethod
    def of(cls, kept: NDArray[Any]) -> Rows:
        """Return those of a picture (h, w, …) that is kept."""
        return cls(kept.shape, kept.dtype, kept.__getitem__, kept)

    def rows(self, some: slice) -> NDArray[Any]:
        """Return some rows (rows, w, …), a view where the picture is kept."""
        if self.kept is not None:
            return self.kept[some]
        drawn = np.empty((some.stop - some.start, *self.shape[1:]), self.dtype)

        def draw(band: slice) -> None:
            drawn[band] = self.draw(slice(some.start + band.start, some.start + band.stop))

        in_picture_bands(draw, len(drawn), self.shape[1])
        return drawn

    def __call__(self) -> NDArray[Any]:
        """Return the whole picture (h, w, …)."""
        return self.kept if self.kept is not None else self.rows(slice(0, self.shape[0]))
