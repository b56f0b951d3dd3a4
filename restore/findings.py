"""Findings that a restoration reports about a page, in one table of codes and sentences.

Code that measures makes a finding with `Finding.of(code, …)`; reports, quality checks, batches and the web interface
read its code and severity. No code reads a sentence. The limits above which a finding is made stay with the code that
measures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Self

from restore.report import FindingReport

Severity = Literal["note", "warning", "doubt"]
"""note: done · warning: act on it · doubt: size or shape is not to be trusted."""


class Code(NamedTuple):
    """Entry of the table.

    fraction_of: what a finding's `share` is a fraction of; empty where it has none.
    """

    severity: Severity
    text: str
    fraction_of: str = ""


NOTABLE = 0.01  # of what a finding is a share of: less is noise, specks, corners

CODES: Mapping[str, Code] = {
    # Files
    "copies_merged": Code("note", "{count} duplicate faces were merged, as of a double-sided export"),
    "colours_left_out": Code(
        "warning",
        "the vertex colours are not used, because the surface cannot be packed into an image: {reason}",
    ),
    "colours_ambiguous": Code(
        "warning",
        "the vertex colours are not used: of the seven numbers of a vertex the fourth and the last never change, so "
        "that either may be the colour. Export six numbers for each vertex: x y z r g b",
    ),
    "bare_faces": Code(
        "warning",
        "{count} of {total} faces have no texture coordinates and are skipped. Check holes that a mesh editor "
        "filled: their faces have none",
        "faces",
    ),
    "faces_not_finite": Code(
        "warning",
        "{count} faces have a vertex that is not a number and are skipped. Export the mesh again if the page "
        "has holes there",
        "faces",
    ),
    "no_picture": Code("warning", "the file has texture coordinates but no image. Give the image with --texture"),
    "pictures_packed": Code("note", "the file has {count} texture images: they were packed into one"),
    "material_missing": Code(
        "warning",
        "the material file {name} is missing, and with it the name of the texture image. Put it next to the "
        "mesh, or give the image with --texture",
    ),
    "material_lacking": Code(
        "warning",
        "the faces use a material that the material file does not define: its only image is used. Check the "
        "colours of the page",
    ),
    "picture_left_out": Code(
        "warning",
        "{count} of {total} faces have no texture coordinates: the image is not used. Export the mesh with "
        "all texture coordinates",
        "faces",
    ),
    "unused_vertices": Code(
        "warning",
        "the faces use the first {share:.1%} of the vertices only. Check whether faces were deleted or the "
        "file is cut short",
        "vertices",
    ),
    "counts_differ": Code(
        "note", "the header of the file counts {count} triangles, the file holds {held}: all of them are read"
    ),
    "bytes_left_out": Code("note", "{count} bytes after the {triangles} triangles of the file are skipped"),
    "decimal_commas": Code("note", "the numbers of the file have decimal commas"),
    "seams_joined": Code(
        "note",
        "{count} vertices at seams up to {reach:.2g} mm apart were joined: their coordinates are rounded",
    ),
    "map_turned_over": Code(
        "warning",
        "{axis}: it was flipped, because only then the colours of the charts match at their seams. Check the "
        "page for mirrored parts",
    ),
    "lines_doubled": Code("note", "{lines} of the segment that repeat those before them: {done}"),
    "fins_cut": Code(
        "warning",
        "faces of {area_mm2:.0f} mm², {share:.1%} of the surface, stand on the page along edges of two other "
        "faces and are removed. Check whether they are noise or leaves of a book",
        "surface",
    ),
    "page_below": Code(
        "warning",
        "a strip, {share:.1%} of the surface, is {step_mm:.1f} mm lower than the page, behind a step. It is classified "
        "as the page below and removed",
        "surface",
    ),
    "edges_unclear": Code(
        "doubt",
        "{count} edges have more than two faces, and the page among them is not clear. Check the page next to them",
    ),
    "debris": Code(
        "warning",
        "{share:.0%} of the surface is in small separate pieces and skipped. Check whether the mesh is complete",
        "surface",
    ),
    "voxel_assumed": Code(
        "doubt",
        "the file does not give the size of a voxel: {voxel} is assumed. Give it with --unit, as 7.91um",
    ),
    "depth_step_assumed": Code(
        "warning",
        "the depth image does not state the length of a step: 1 mm is assumed. If the page has another size, give it "
        "with --unit, as 0.2mm",
    ),
    "unit_too_large": Code(
        "doubt",
        "the coordinates are too large for {standard}, the unit of the format: read as {unit}. Check the size "
        "of the page, or give --unit",
    ),
    "mirrored": Code(
        "warning",
        "image and surface are mirror images of each other: the page reads as the image does. If that is wrong, "
        "mirror the page with --mirror",
    ),
    "flying_pixels": Code(
        "note",
        "{share:.1%} of the points are between a near and a far surface, on neither, and are removed",
        "points",
    ),
    "coarse_mesh": Code(
        "doubt",
        "the shape is that of a phone's mesh, accurate to some millimetres at best: creases and waves are "
        "smoothed. Use photographs alone (planish photos) for a far more accurate page",
    ),
    "lens_unknown": Code(
        "warning",
        "the capture has no corrected images: the distortion of the lens is not known, and print may deviate "
        "by some pixels. Process the capture again in developer mode",
    ),
    # The scan
    "other_surfaces": Code(
        "warning",
        "the scan shows {surfaces} as large as a page: only the largest is restored. Call `separate_sheets` "
        "for the others",
    ),
    "unconnected": Code(
        "warning",
        "{share:.0%} of the measured samples off the table do not connect to the page and are left out. Where they "
        "show a part of the page, raise the laser power for dark ink, or turn the page so that steep parts are seen",
        "samples",
    ),
    "unseen_edge": Code(
        "warning",
        "colour does not distinguish paper from table, and {share:.0%} of the page's outline touches the "
        "table: its edge is not seen there. Scan in colour, on a cloth of another colour than the paper",
        "outline",
    ),
    "lost_border": Code(
        "warning",
        "along at least {share:.0%} of the page border range data are missing although it is not in shadow: "
        "paper may be missing there. Raise the laser power if it is dark or glossy, move the scanner back if it is "
        "near, or tilt the page towards the laser",
        "border",
    ),
    "turned_border": Code(
        "warning",
        "along {share:.0%} of its border the page is tilted by more than 70° from the scanner: paper beyond "
        "it may be missing. Tilt the page, or scan it from another side",
        "border",
    ),
    "cut_off": Code(
        "warning",
        "{share:.0%} of the page's outline is at the edge of the image: the page may go on outside. Move the "
        "page into the image, or the scanner back; if the table is part of the page, use a dark cloth",
        "outline",
    ),
    "overexposed": Code(
        "warning",
        "{share:.0%} of the white image is overexposed: edges of the patterns shift there. Reduce the exposure",
        "lit picture",
    ),
    "view_left_out": Code("warning", "the view at {turn_deg:g}° is not used: {reason}"),
    # The page
    "holes": Code(
        "warning",
        "through holes in the page, {area_mm2:.0f} mm² in all, the table was measured: the page is blank there",
    ),
    "hidden": Code(
        "warning",
        "{share:.0%} of the page is hidden from the camera and white. Scan or photograph it from another side",
        "page",
    ),
    "filled": Code(
        "warning",
        "an area of the page {across_mm:.0f} mm across has no range data, and its shape is interpolated. Unless it is "
        "a hole, raise the laser power for dark ink, or turn glossy paper out of the light, and scan again; or take "
        "more photographs of it",
    ),
    "gap": Code(
        "warning",
        "the surface has a hole {across_mm:.0f} mm across, and the page is white there. Unless the paper has it, "
        "scan or photograph it again, or fill the hole in a mesh editor and texture it",
    ),
    "no_colour": Code("note", "the scan has no colour image: the page shows the relief of its surface"),
    "pieces": Code("note", "the surface is in {count} pieces, packed next to each other in one image"),
    "upside_down": Code(
        "doubt",
        "{share:.0%} of the faces are flipped: the page is folded there. Use another method",
        "faces",
    ),
    "not_developable": Code(
        "doubt",
        "the surface cannot be flattened without stretching: {strain:.1%} rms strain remains. Check the scan "
        "for objects on the page",
    ),
    "lengths_estimated": Code(
        "doubt",
        "{share:.0%} of the edges bend too strongly to measure their lengths, which are estimated: the page "
        "size depends on them. Use a finer mesh",
        "edges",
    ),
    "light_kept": Code("warning", "the illumination is not corrected: {reason}"),
    "white_kept": Code("warning", "the white balance is not changed: {reason}"),
    # Photographs
    "photo_refused": Code("warning", "{name} is not used: {reason}"),
    "photo_covered": Code(
        "warning",
        "{name}: something obstructs the page or is reflected in it over {area_cm2:.1f} cm², {share:.1%} of "
        "the page, which is textured from other images. Look at the coverage map, and photograph the page "
        "again if it matters",
        "page",
    ),
    "view_apart": Code("warning", "{name} is not used: {reason}"),
    "zoomed": Code("warning", "it is zoomed: its focal length differs by {change:+.0%}"),
    "cropped": Code(
        "warning", "it is cropped: its principal point deviates from the others by {shift:.0%} of the image width"
    ),
    "other_page": Code("warning", "it shows another page, or this page moved, or it is not sharp"),
    "other_shape": Code("warning", "it shows another print, or the page in another shape"),
    "not_joined": Code("warning", "{reason}"),
    "few_views": Code(
        "doubt",
        "the page is made of {count} photographs only: it may be wrong by half a millimetre, and nothing in "
        "them shows it. Take {enough} or more",
    ),
    "views_zoomed": Code(
        "doubt",
        "some photographs were zoomed or cropped, and others may be by less than can be detected: the page's "
        "size is not reliable. Give photographs as the camera wrote them",
    ),
    "no_scale": Code(
        "doubt",
        "the scale is not known: all sizes, and the dpi of the page, are estimates. Put the scale card next "
        "to the page, or give --scale",
    ),
    "edge_unseen": Code(
        "doubt",
        "only {share:.0%} of the page's edge is found in the photographs; the rest is extrapolated from the "
        "print, and the page's size is not reliable. Photograph steep sides obliquely, too",
        "edge",
    ),
    "surface_off": Code(
        "doubt",
        "one in ten of the measured points is {distance_mm:.1f} mm or more from the surface: the page is "
        "creased, or its shape was not found. Take more photographs, some of them oblique",
    ),
    "area_gained": Code(
        "doubt",
        "the surface has {change:+.1%} of area that paper cannot have: it is torn or doubled next to a "
        "crease, and the page's size is not reliable. Photograph the creases from both sides",
    ),
    "gutter_uneven": Code(
        "doubt",
        "the strip across the spine is {distance_mm:.1f} mm wider in some rows than in others: its shape was not "
        "found, and the page's size is not reliable. Photograph the spine from both sides",
    ),
    "paper_uncovered": Code(
        "warning",
        "{share:.0%} of the paper in the photographs is not on the restored page: its sides are too steep for "
        "these views, or another sheet is next to it. Photograph the sides obliquely",
        "paper",
    ),
    "card_in_few": Code(
        "doubt",
        "fewer than three photographs show the scale card. Put the one of `planish card` next to the page, "
        "whole in each photograph",
    ),
    "card_moved": Code(
        "warning",
        "page or card was moved: in {names} the card has another position; the scale is taken from the other "
        "photographs",
    ),
    "card_uneven": Code(
        "doubt",
        "the markers of the card deviate by {distance_mm:.2f} mm: it was not flat or not printed evenly, and "
        "the page's size is not reliable. Print the card again, on flat paper",
    ),
    # Colour charts
    "uneven_light": Code(
        "warning",
        "the light falls off by {share:.0%} over the chart: it is removed from the profile, and no level is "
        "claimed. Light the chart evenly and capture it again",
        "brightest",
    ),
    # The run
    "largest_of_pieces": Code(
        "warning",
        "the scan holds {count} pieces of surface: the largest is the page, the next is {share:.0%} as large. "
        "Use --sheets separate for a page of each",
        "largest piece",
    ),
    "large_sheet_left_out": Code(
        "doubt",
        "a sheet {share:.0%} as large as the page is not restored: half of an opened book, or another page; --sheets "
        "separate restores all {count} sheets of the scan",
        "largest piece",
    ),
    # Leaves of a book
    "layout_unsure": Code(
        "warning",
        "it is not clear whether this is an opened book, and the whole is one page: {reason}; --layout split cuts it "
        "at the spine, --layout whole keeps it",
    ),
    "part_not_found": Code(
        "note", "the corrections of the part {part} are not used: the scan gives {parts}. Check the layout"
    ),
    "facing_strip": Code("note", "a strip of the facing page, {width_mm:.0f} mm wide, is not restored"),
    "gutter_hidden": Code(
        "warning",
        "the gutter gave no range over {width_mm:.0f} mm: the leaves are two sheets, and two pages",
    ),
    "print_over_spine": Code(
        "note", "print runs over the spine along {share:.1%} of its height: the whole is one page", "height"
    ),
    "print_cut": Code(
        "warning",
        "the page is split as requested although print runs over the spine along {share:.1%} of its height: each leaf "
        "keeps {overlap_mm:g} mm of the other",
        "height",
    ),
    # Corrections by hand
    "removed_by_hand": Code("note", "{share:.1%} of the page was removed by hand", "page"),
    "size_differs": Code(
        "warning",
        "the page is {width_mm:.1f} × {height_mm:.1f} mm, and {given_width_mm:g} × {given_height_mm:g} mm were given. "
        "Check outline and spine, or the given size",
    ),
    "size_wrong": Code(
        "doubt",
        "the page is {width_mm:.1f} × {height_mm:.1f} mm, and {given_width_mm:g} × {given_height_mm:g} mm were given: "
        "it is another leaf, or not the whole of one. Draw outline and spine, or correct the given size",
    ),
    "turn_undecided": Code(
        "warning",
        "the text does not show which side of the page is up: it stays as the scanner saw it. Rotate it with "
        "--rotate 90|180|270",
    ),
    "words_mirrored": Code("warning", "its words are read in a mirror only: the page was mirrored"),
    "words_doubtful": Code(
        "warning",
        "the words have a mean confidence of {confidence:.0f} of 100, less than {least:.0f}. Check the rotation of the "
        "page, whether it is mirrored, and the language",
    ),
}


@dataclass(frozen=True)
class Finding:
    """One thing that a restoration reports about a page.

    code: key of CODES: all that code may branch on.
    severity: note, warning or doubt.
    share: 0 to 1, of what the code's entry names; None where it is not a fraction.
    text: one sentence for the operator, with the remedy.

    >>> found = Finding.of("cut_off", 0.12)
    >>> found.severity, found.text[:27]
    ('warning', "12% of the page's outline i")
    >>> Finding.all_in({"findings": [found.as_json()]}) == (found,)
    True
    """

    code: str
    severity: Severity
    share: float | None
    text: str

    @classmethod
    def of(cls, code: str, share: float | None = None, **values: Any) -> Self:
        """Make a finding of a code of the table.

        Its sentence is filled in with a fraction and other values. Raises KeyError for an unknown code or a missing
        value.
        """
        severity, text, _ = CODES[code]
        return cls(code, severity, share, text.format(share=share, **values))

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Make a finding of a JSON object as `as_json` writes it; raises ValueError."""
        match value:
            case {"code": str(code), "severity": "note" | "warning" | "doubt" as severity, "text": str(text)}:
                share = value.get("share")
                return cls(code, severity, float(share) if isinstance(share, int | float) else None, text)
        raise ValueError("not a finding: an object with code, severity, share and text")

    @classmethod
    def all_in(cls, report: Mapping[str, Any]) -> tuple[Self, ...]:
        """The findings of a report."""
        recorded = report.get("findings", ())
        return tuple(map(cls.from_json, recorded)) if isinstance(recorded, list | tuple) else ()

    def as_json(self) -> FindingReport:
        """The finding as plain JSON values, as reports and stored scans hold it."""
        return {"code": self.code, "severity": self.severity, "share": self.share, "text": self.text}
