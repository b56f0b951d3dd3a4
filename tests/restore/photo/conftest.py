"""A page before the scanner and before another camera, with the truth about both."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import pytest

from drivers.simulated import Figure, Text, Truth
from drivers.simulated.scene.artwork import Artwork
from oracles.simulation.camera import Camera, Exposure
from oracles.studio import SHEETS, VIEWS, View, restored_mesh, scan_page, take_photograph
from restore import FlatMesh, Photograph, RangeScan
from restore.photo.reference import Reference, make_reference
from restore.photo.register import Registration, register
from restore.scan import Bytes

SIZE = (1280, 853)
WINDOW_LIGHT = Exposure()


@dataclass(frozen=True)
class Studio:
    """A warped page, its scan, and photographs of it; everything is made once."""

    sheet: str
    artwork: Artwork

    @property
    def scan(self) -> RangeScan:
        return scan_page(SHEETS[self.sheet], self.artwork)[1]

    @property
    def truth(self) -> Truth:
        return scan_page(SHEETS[self.sheet], self.artwork)[2]

    @property
    def page(self) -> FlatMesh:
        return restored_mesh(SHEETS[self.sheet], self.artwork)

    @property
    def reference(self) -> Reference:
        return _reference(self)

    def camera(self, view: str | View = "above") -> Camera:
        return (VIEWS[view] if isinstance(view, str) else view).camera(SIZE)

    def photograph(self, view: str | View = "above", light: Exposure = WINDOW_LIGHT, **artwork: float) -> Bytes:
        """A photograph by some light, its paper changed (gloss) if wanted."""
        if artwork:
            return _photograph(Studio(self.sheet, replace(self.artwork, **artwork)), view, light)
        return _photograph(self, view, light)

    def registered(self, view: str = "above") -> Registration:
        return _registered(self, view)


@cache
def _reference(studio: Studio) -> Reference:
    return make_reference(studio.page)


@cache
def _photograph(studio: Studio, view: str | View, light: Exposure) -> Bytes:
    return take_photograph(scan_page(SHEETS[studio.sheet], studio.artwork)[0], studio.camera(view), exposure=light)


@cache
def _registered(studio: Studio, view: str) -> Registration:
    return register(studio.reference, Photograph(studio.photograph(view)))


@pytest.fixture(scope="session")
def text() -> Studio:
    return Studio("binding", Text())


@pytest.fixture(scope="session")
def figure() -> Studio:
    return Studio("Miura fold", Figure())
