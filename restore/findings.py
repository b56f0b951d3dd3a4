"""Findings: what a restoration reports about a page, and the one table of their codes and sentences.

Code that measures makes a finding with `Finding.of(code, …)`; reports, quality checks, batches and the console read
its code and severity. No code looks into a sentence. The limits above which a finding is made stay with what measures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal, NamedTuple, Self

Severity = Literal["note", "warning", "doubt"]
"""note: done for the operator · warning: act on it · doubt: size or shape is not to be trusted."""


class Code(NamedTuple):
    """An entry of the table.

    share_of  what a finding's `share` is a fraction of; empty where it has none.
    """

    severity: Severity
    text: str
    share_of: str = ""


RECORDED = "recorded"  # a sentence of an older record, which had no codes

CODES: Mapping[str, Code] = {
    # Files
    "copies_merged": Code("note", "faces that lay on others, as in a double-sided export, were merged: {count}"),
    "colours_left_out": Code(
        "warning",
        "the colours of its vertices are left out, as its surface cannot be laid out for a picture: {reason}",
    ),
    "bare_faces": Code(
        "warning",
        "{count} of {total} faces have no texture coordinates and are left out: holes that were filled in a mesh "
        "editor have none",
        "faces",
    ),
    "faces_not_finite": Code(
        "warning",
        "{count} faces have a vertex that is not a number, and are left out: the page has holes there",
        "faces",
    ),
    "no_picture": Code(
        "warning", "the file has texture coordinates and no picture: --texture gives one, and paints the page with it"
    ),
    "pictures_packed": Code("note", "the file textures its surface from {count} pictures: they were packed into one"),
    "material_missing": Code("warning", "its material file {name} is missing, and with it the name of its picture"),
    "material_lacking": Code(
        "warning", "the faces use a material that the material file lacks: the one picture of that file is taken"
    ),
    "picture_left_out": Code(
        "warning", "{count} of {total} faces have no texture coordinates: the picture is left out", "faces"
    ),
    "unused_vertices": Code(
        "warning",
        "the faces use the first {share:.1%} of the vertices: were faces deleted, or is the file cut short?",
        "vertices",
    ),
    "counts_differ": Code(
        "note", "the header of the file counts {count} triangles, it holds {held}: all of them are read"
    ),
    "bytes_left_out": Code("note", "{count} bytes behind the {triangles} triangles of the file are left out"),
    "decimal_commas": Code("note", "the numbers of the file have decimal commas"),
    "seams_joined": Code(
        "note",
        "{count} vertices at seams that lay up to {reach:.2g} mm apart were joined, as their places were rounded",
    ),
    "map_turned_over": Code(
        "warning",
        "{axis}: it is turned over, as the colours of the charts meet at their seams then, and not before",
    ),
    "lines_doubled": Code("note", "{lines} of the segment that repeat those before them: {done}"),
    "fins_cut": Code(
        "warning",
        "faces of {area_mm2:.0f} mm², {share:.1%} of the surface, stand on the page along edges that have two others, "
        "and are cut away: they can be noise of the reconstruction, or leaves of a book",
        "surface",
    ),
    "edges_unclear": Code(
        "doubt",
        "{count} edges have more than two faces, and it is not clear which are the page: it may be wrong next to them",
    ),
    "debris": Code(
        "warning",
        "{share:.0%} of the surface is in small separate pieces, and left out: is the mesh whole?",
        "surface",
    ),
    "voxel_assumed": Code(
        "doubt",
        "the file does not tell the size of a voxel: it is taken for {voxel}; --unit gives it, as 7.91um",
    ),
    "unit_too_large": Code(
        "doubt", "the coordinates are too large for {standard}, the unit of the format: read as {unit}"
    ),
    "mirrored": Code(
        "warning",
        "the picture and the surface are mirror images of each other: the page reads as the picture does; where that "
        "is wrong, mirror the picture, or turn v of the texture coordinates over, and export again",
    ),
    "coarse_mesh": Code(
        "doubt",
        "the shape is that of a phone's mesh, which is good to some millimetres at best: creases and waves of the page "
        "are smoothed; photographs alone (planish photos) measure a page far finer",
    ),
    "lens_unknown": Code(
        "warning",
        "the capture has no corrected images: the distortion of the lens is not known, and print may be off by some "
        "pixels; process the capture again in developer mode",
    ),
    # The scan
    "other_surfaces": Code(
        "warning",
        "the scan shows {surfaces} as large as a page: `separate_sheets` gives each, the largest alone is restored",
    ),
    "unseen_edge": Code(
        "warning",
        "colour does not tell the paper from the table, and {share:.0%} of the page's outline touches it, where its "
        "edge is not seen: scan in colour, on a cloth of another colour than the paper",
        "outline",
    ),
    "lost_border": Code(
        "warning",
        "along {share:.0%} of its border or more the page ends where the scanner measured nothing and no shadow falls: "
        "dark or glossy paper there is not on the page; scan with more laser power, or turn it to the laser",
        "border",
    ),
    "turned_border": Code(
        "warning",
        "along {share:.0%} of its border the page is turned from the scanner by more than 70°: paper beyond it may not "
        "have been seen; tilt the page, or scan it from another side",
        "border",
    ),
    "cut_off": Code(
        "warning",
        "{share:.0%} of the page's outline is at the edge of the picture, where the page may go on unseen: move it "
        "into the picture, or the scanner back; if the table is shown as a part of it, lay it on a dark cloth",
        "outline",
    ),
    "overexposed": Code(
        "warning",
        "{share:.0%} of the white picture is overexposed: edges of the patterns shift there; expose less",
        "lit picture",
    ),
    "view_left_out": Code("warning", "the view at {turn_deg:g}° was left out: {reason}"),
    # The page
    "holes": Code(
        "warning",
        "through holes in the page, {area_mm2:.0f} mm² in all, the table was measured: the page is blank there",
    ),
    "hidden": Code(
        "warning",
        "{share:.0%} of the page is hidden from the camera, and white: scan or photograph it from another side",
        "page",
    ),
    "filled": Code(
        "warning",
        "an area of the page {across_mm:.0f} mm across gave no range, and its shape is filled in from beside it: "
        "unless it is a hole, raise the laser power for dark ink, or turn glossy paper out of the light, and "
        "scan again",
    ),
    "no_colour": Code("note", "the scan has no colour image: the page shows the relief of its surface"),
    "pieces": Code("note", "the surface is in {count} pieces, laid out beside each other in one picture"),
    "upside_down": Code(
        "doubt",
        "{share:.0%} of the faces lie upside down, the page is folded there: use another method",
        "faces",
    ),
    "not_developable": Code(
        "doubt", "the surface cannot be laid flat without stretching: {strain:.1%} rms strain remains"
    ),
    "lengths_estimated": Code(
        "doubt",
        "{share:.0%} of the edges bend by so much that their lengths are estimates: the mesh is coarse for its "
        "surface, and the page's size rests on them",
        "edges",
    ),
    "light_kept": Code("warning", "the light is kept: {reason}"),
    "white_kept": Code("warning", "the colour of the light is kept: {reason}"),
    # Photographs
    "photo_refused": Code("warning", "{name} is not used: {reason}"),
    "photo_covered": Code(
        "warning",
        "{name}: something covers the page or is mirrored in it over {area_cm2:.1f} cm², {share:.1%} of the page; it "
        "is painted from elsewhere: look at the coverage map, and photograph the page again with nothing over it if "
        "that matters",
        "page",
    ),
    "view_apart": Code("warning", "{name} is left out: {reason}"),
    "zoomed": Code("warning", "it is zoomed: its focal length is {change:+.0%}"),
    "cropped": Code("warning", "it is cropped: the middle of its lens is {shift:.0%} of its width off the others'"),
    "other_page": Code("warning", "it shows another page, or this one where it did not lie before, or not sharply"),
    "other_shape": Code("warning", "it shows another print, or the page bent otherwise"),
    "not_joined": Code("warning", "{reason}"),
    "few_views": Code(
        "doubt",
        "the page is made of {count} photographs only: it may be half a millimetre wrong, and nothing in them tells; "
        "take {enough} or more",
    ),
    "views_zoomed": Code(
        "doubt",
        "photographs were zoomed or cropped, and the others may be so by less than can be told: the page's size is not "
        "to be trusted; give photographs as the camera wrote them",
    ),
    "no_scale": Code("doubt", "the scale is not known: all sizes, and the dpi of the page with them, are guesses"),
    "edge_unseen": Code(
        "doubt",
        "only {share:.0%} of the page's edge is found in the photographs: the rest is prolonged from the print, and "
        "the page's size is not to be trusted; photograph steep sides from beside them, too",
        "edge",
    ),
    "surface_off": Code(
        "doubt",
        "the surface passes one in ten of the measured points {distance_mm:.1f} mm and more away: the page is creased, "
        "or its shape was not found, and the result is not to be trusted",
    ),
    "area_gained": Code(
        "doubt",
        "the surface has {change:+.1%} of area that paper cannot have: it is torn or doubled beside a crease, and the "
        "page's size is not to be trusted; photograph the creases from both sides",
    ),
    "paper_uncovered": Code(
        "warning",
        "{share:.0%} of the paper in the photographs is not on the restored page: its sides are too steep for these "
        "views, or another sheet lies beside it",
        "paper",
    ),
    "card_in_few": Code(
        "doubt",
        "fewer than three photographs show the scale card: lay the one of `planish card` beside the page, whole in "
        "each of them",
    ),
    "card_moved": Code(
        "warning",
        "page or card was moved: in {names} the card lies elsewhere beside the page; the scale is taken from the "
        "others",
    ),
    "card_uneven": Code(
        "doubt",
        "the markers of the card are {distance_mm:.2f} mm off their places: it was not flat or not printed evenly, and "
        "the page's size is not to be trusted",
    ),
    # Colour charts
    "uneven_light": Code(
        "warning",
        "the light falls off by {share:.0%} over the chart: it is divided out of the profile, and no level is claimed; "
        "light the chart evenly and shoot it again",
        "brightest",
    ),
    # The run
    "largest_of_pieces": Code(
        "warning",
        "the scan holds {count} pieces of surface: the largest is the page, the next is {share:.0%} as large; --sheets "
        "each makes a page of each",
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
    "facing_strip": Code("note", "a strip of the facing page, {width_mm:.0f} mm wide, is not restored"),
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
    "points_clipped": Code(
        "warning", "{count} points of the corrections are outside the image and were moved to its edge: check them"
    ),
    "corrections_dropped": Code(
        "warning", "the corrections of the earlier capture do not fit this one: {reason}; make them again"
    ),
    "turn_undecided": Code(
        "warning",
        "the words do not tell which way up the page is: it stays as the scanner saw it, --rotate 90|180|270 turns it",
    ),
    RECORDED: Code("warning", "{text}"),
}


@dataclass(frozen=True)
class Finding:
    """One thing that a restoration reports about a page.

    code      key of CODES: all that code may branch on.
    severity  note, warning or doubt.
    share     0 to 1, of what the code's entry names; None where it is not a fraction.
    text      one sentence for the operator, with the remedy.

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
        """A finding of a code of the table, its sentence filled in with a fraction and other values.

        Raises KeyError for an unknown code or a missing value.
        """
        severity, text, _ = CODES[code]
        return cls(code, severity, share, text.format(share=share, **values))

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """The finding of a JSON object as `as_json` writes it, or of a plain sentence of an older record.

        Raises ValueError for anything else.
        """
        match value:
            case str(text):
                return cls.of(RECORDED, text=text)
            case {"code": str(code), "severity": "note" | "warning" | "doubt" as severity, "text": str(text)}:
                share = value.get("share")
                return cls(code, severity, float(share) if isinstance(share, int | float) else None, text)
        raise ValueError("not a finding: an object with code, severity, share and text")

    @classmethod
    def all_in(cls, report: Mapping[str, Any]) -> tuple[Self, ...]:
        """The findings of a report, also of an older one, whose `warnings` are sentences."""
        recorded = report.get("findings", report.get("warnings", ()))
        return tuple(map(cls.from_json, recorded)) if isinstance(recorded, list | tuple) else ()

    def as_json(self) -> dict[str, Any]:
        """The finding as plain JSON values, as reports and stored scans hold it."""
        return asdict(self)
