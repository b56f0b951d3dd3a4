"""What is printed on a page. ARTWORK maps the name in a configuration to the artwork."""

from __future__ import annotations

from drivers.simulated.scene.artwork.chart import Chart
from drivers.simulated.scene.artwork.engraving import Engraving
from drivers.simulated.scene.artwork.facing import Facing, Leather
from drivers.simulated.scene.artwork.figure import Figure
from drivers.simulated.scene.artwork.markers import Markers, White
from drivers.simulated.scene.artwork.printed import Artwork, Box, Print, Word
from drivers.simulated.scene.artwork.text import Text

__all__ = [
    "ARTWORK",
    "Artwork",
    "Box",
    "Chart",
    "Engraving",
    "Facing",
    "Figure",
    "Leather",
    "Markers",
    "Print",
    "Text",
    "White",
    "Word",
]

ARTWORK: dict[str, type[Artwork]] = {
    kind.name: kind for kind in (White, Markers, Text, Figure, Facing, Leather, Engraving, Chart)
}
