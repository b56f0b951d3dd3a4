"""What is printed on a page. ARTWORK maps the name in a configuration to the artwork."""

from __future__ import annotations

from drivers.simulated.artwork.chart import Chart
from drivers.simulated.artwork.figure import Figure
from drivers.simulated.artwork.markers import Markers, White
from drivers.simulated.artwork.printed import Artwork, Box, Print, Word
from drivers.simulated.artwork.text import Text

__all__ = ["ARTWORK", "Artwork", "Box", "Chart", "Figure", "Markers", "Print", "Text", "White", "Word"]

ARTWORK: dict[str, type[Artwork]] = {kind.name: kind for kind in (White, Markers, Text, Figure, Chart)}
