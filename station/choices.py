"""Values of options that are one of several words."""

from __future__ import annotations

from enum import StrEnum
from typing import Literal

FLAGS = ("tiff", "map", "mesh", "strain", "frames", "review", "ocr", "coverage")
"""Output files, as the options of a run and the `outputs` of presets name them."""


EDITS_SUFFIX = ".edits.json"
"""What follows the stem of a scan in the name of its corrections by hand."""

Method = Literal["isometric", "sticks", "springs", "conformal", "applicable"]
Shading = Literal["keep", "remove"]
"""The values of `restore.Settings`.

Repeated so that the command line knows them without loading the library.
"""


class Sheets(StrEnum):
    """What becomes of several pieces of surface in one scan.

    AUTO: rectangular sheets of a mesh as SEPARATE, fragments as TOGETHER, a capture of the scanner as LARGEST.
    SEPARATE: each is a page, `<stem>-1`, `<stem>-2` and so on, left to right as the scanner saw them.
    LARGEST: the largest is the page; a warning reports the others.
    TOGETHER: all are arranged in one picture.
    """

    AUTO = "auto"
    SEPARATE = "separate"
    LARGEST = "largest"
    TOGETHER = "together"


class Layout(StrEnum):
    """What becomes of an opened book.

    SINGLE  every sheet is a page, as it lies; the leaves of a gutter without range are two.
    AUTO    two leaves where a spine is certain and no print runs over it, else one page.
    SPLIT   two leaves, at the deepest valley.
    WHOLE   one page.
    """

    SINGLE = "single"
    AUTO = "auto"
    SPLIT = "split"
    WHOLE = "whole"


class Rotation(StrEnum):
    """Degrees, clockwise, by which a page is turned; AUTO as its words are read."""

    NONE = "0"
    QUARTER = "90"
    HALF = "180"
    THREE_QUARTERS = "270"
    AUTO = "auto"
