"""A sheet that was flattened while its spine was looked for.

It need not be flattened again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from restore.flattening.methods import OnStep
from restore.prepared.facet_sheet import FacetSheet
from restore.prepared.prepared import Clock, Unrolled
from restore.settings import Settings


@dataclass(frozen=True, eq=False)
class FlattenedSheet(FacetSheet):
    """A prepared sheet with its flat page, as certain settings make it."""

    unrolled: Unrolled = field(kw_only=True)
    settings: Settings = field(kw_only=True)

    @property
    def as_scanned(self) -> FacetSheet:
        """The sheet alone, which does not depend on its settings."""
        return FacetSheet(self.sheet, self.is_one_shot)

    def unroll(self, settings: Settings, clock: Clock, on_step: OnStep | None = None) -> Unrolled:
        """Return the flat page that exists, or another for other settings or a watcher of steps."""
        same = (settings.points, settings.method) == (self.settings.points, self.settings.method)
        return self.unrolled if same and on_step is None else super().unroll(settings, clock, on_step)
