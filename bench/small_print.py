"""Small print read from one shot and from several: `python -m bench.small_print`.

A curled page of 230 × 160 mm before the MIDDLE lens at 0.9 m, 53 pixels to the inch. The shots come from the driver of
the simulated device as `planish scan --super-resolution` takes them: a hand moves the page by half a pixel at most
between them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from drivers.simulated import connect, rig
from drivers.vivid900.geometry.lenses import FINE
from drivers.vivid900.settings import VividSettings
from restore import RangeScan, Settings, restore
from restore.texture.super_resolution import super_resolve
from station.words.ocr_precision import MatchCount, count_matching_characters, count_matching_words
from station.words.words import recognise

SIZES_PT = (8.0, 9.0, 10.0)
COUNTS = (1, 4, 9)
NUDGE_PX = 0.5
DPI = 150.0


def station(size_pt: float) -> Mapping[str, Any]:
    """The `[scanner]` table of a page of such print."""
    text = {"name": "text", "title_pt": 24.0, "sizes_pt": [size_pt], "margin_mm": 13.0, "seed": 3}
    scene = {"sheet": {"name": "curl", "radius_mm": 200.0}, "artwork": text, "page_mm": [230, 160]}
    return {"driver": "simulated", "nudge_px": NUDGE_PX, "scene": scene}


def shots(config: Mapping[str, Any], count: int) -> list[RangeScan]:
    """`count` captures of the page."""
    with connect(config) as scanner:
        return [scanner.capture(VividSettings()) for _ in range(count)]


def printed(config: Mapping[str, Any]) -> str:
    """The text of the page."""
    return " ".join(word.text for word in rig(config).sensor.truth(FINE).words)


def read(taken: Sequence[RangeScan], text: str) -> tuple[MatchCount, MatchCount]:
    """Words and characters read in the page that these shots give together."""
    scan = super_resolve(taken) if len(taken) > 1 else taken[0]
    page = restore(scan, Settings(dpi=DPI, shading="remove"))
    recognised = recognise(page.image, DPI, name="page").text
    return count_matching_words(text, recognised), count_matching_characters(text, recognised)


def main() -> None:
    """Print a line for every size of print."""
    print("words / characters read right, per cent")
    print("print  " + "".join(f"{f'{count} shots' if count > 1 else 'one shot':>16}" for count in COUNTS))
    for size in SIZES_PT:
        config = station(size)
        taken, text = shots(config, max(COUNTS)), printed(config)
        cells = [" / ".join(f"{100 * r.precision:.1f}" for r in read(taken[:count], text)) for count in COUNTS]
        print(f"{size:>4g} pt" + "".join(f"{cell:>16}" for cell in cells), flush=True)


if __name__ == "__main__":
    main()
