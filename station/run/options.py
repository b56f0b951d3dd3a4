"""How a scan is restored and what is written of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from restore import PageEdits, Settings
from restore.runtime import Kept
from station.choices import Layout, Rotation, Sheets

AUTO = "auto"
READING = ("unit", "grid", "depth")
"""How a scan file is read: options of `load_scan`, and facts of a capture."""


@dataclass(frozen=True)
class RunOptions:
    """How scans are restored and which files are written.

    settings  of the restoration; those that were given are its `model_fields_set`.
    outputs   kinds of `outputs.OUTPUTS` on top of the page and its report.
    language  of the words, as Tesseract calls it, when they are read.
    colours   ICC profile of the colour image, as `planish colour` writes it; None for sRGB.
    to_srgb   convert the page from that profile to sRGB; the master keeps codes and profile.
    unit      of a mesh's coordinates, as for `load_scan`; range images have their own.
    grid, depth  of a cloud and of a depth image, as for `load_scan`.
    scale     of photographs, as `planish photos` has it, or the size of the page of a mesh; None for that of the scan.
    sheets    what becomes of several sheets in one scan.
    both_leaves  whether the leaves of a gutter without range are two pages, whatever `sheets` says.
    layout    what becomes of an opened book.
    mirror    mirror the page from left to right, before it is rotated.
    edits     corrections by hand; their layout takes the place of `layout`.
    rotate    right angles by which the page is rotated.
    allow_distorted    write a page even when its surface cannot be a page's.
    kept      results of an earlier restoration of the same scan, which change nothing of this one.
    """

    settings: Settings = field(default_factory=Settings)
    outputs: frozenset[str] = frozenset()
    language: str = "eng"
    colours: bytes | None = None
    to_srgb: bool = False
    unit: str = AUTO
    grid: str = AUTO
    depth: str = AUTO
    scale: str | None = None
    sheets: Sheets = Sheets.AUTO
    both_leaves: bool = False
    layout: Layout = Layout.SINGLE
    mirror: bool = False
    edits: PageEdits | None = None
    rotate: Rotation = Rotation.NONE
    allow_distorted: bool = False
    kept: Kept | None = field(default=None, compare=False)

    def with_implied_outputs(self) -> RunOptions:
        """Return the options with the outputs that they imply.

        The master when light or colours change, the coverage when occluded places are inpainted, the
        uncertainty when it is estimated, the uncropped master when a page is cropped or a part of it removed by hand.
        """
        changed = self.settings.shading == "remove" or self.settings.white_balance != "keep" or self.to_srgb
        implied = {"master": changed, "coverage": self.settings.inpaint_mm > 0}
        parts = () if self.edits is None else self.edits.parts.values()
        implied["uncropped"] = any(
            part.crop.mode != "paper" or any(mask.what == "remove" for mask in part.masks) for part in parts
        )
        implied["uncertainty"] = self.settings.uncertainty
        return replace(self, outputs=self.outputs | {kind for kind, on in implied.items() if on})


def reading_of(facts: Mapping[str, Any]) -> dict[str, str]:
    """Return how a scan is read, for `load_scan`, of facts or parameters that name it."""
    return {name: str(facts[name]) for name in READING if name in facts}
