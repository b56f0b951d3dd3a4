"""The report of a page: its keys, with types and meanings, as they are in JSON.

A report is a plain dictionary, so that `json.dumps` writes it. Each part is made by the module that measures it, and
`restore` joins them. Keys name their units: `_mm`, `_px`, `_ppi`, `_deg`; a `_fraction` is 0 to 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, NotRequired, TypedDict


class FindingReport(TypedDict):
    code: Annotated[str, "which finding it is"]
    severity: Annotated[str, "`note` (done for you), `warning` (act on it) or `doubt` (do not trust size or shape)"]
    share: Annotated[float | None, "fraction of its subject"]
    text: Annotated[str, "a sentence for the operator"]


class ConvergenceReport(TypedDict):
    residual: Annotated[float, "rms strain that vertices could still be relieved of"]
    converged: Annotated[bool, "whether the solver reached its tolerance"]


class FaceStrainReport(TypedDict):
    stretch: Annotated[dict[str, float], "greatest stretch of each face, weighted by area: `mean`, `rms`, `max`"]
    shear: Annotated[dict[str, float], "shear of each face"]


class ChordStrainReport(TypedDict):
    rms: float
    max: float
    estimate_rms: Annotated[float, "rms difference of rest lengths and straight lengths"]
    estimated_fraction: Annotated[float, "edges whose rest length differs by over 1 %"]
    max_difference_at_mm: Annotated[list[float], "place of the greatest difference on the page"]


class StrainReport(TypedDict):
    rms: Annotated[float, "over all edges"]
    smooth_rms: Annotated[float, "of the page as a whole, in cells of a twentieth of its size"]
    max: Annotated[float, "of the worst edge, absolute"]
    faces: Annotated[FaceStrainReport, "of the faces, weighted by area"]
    chord_strain: Annotated[ChordStrainReport, "against straight edge lengths"]


class DistanceReport(TypedDict, total=False):
    mean_mm: Annotated[float, "mean of a distance"]
    sd_mm: Annotated[float, "standard deviation of a distance"]
    max_mm: Annotated[float, "greatest value of a distance"]


class ResolutionReport(TypedDict, total=False):
    """What the source of a page, or a photograph, resolves."""

    resolved_ppi: Annotated[float | None, "what the source resolves: twice the MTF50"]
    sampling_ppi: Annotated[float, "pixels of the source for one inch of paper, 0 without an image"]
    mtf50_per_mm: Annotated[float | None, "frequency at half contrast"]
    resolved_ppi_unknown: Annotated[str, "why the MTF is not measured"]


class SampleReport(TypedDict, total=False):
    """How much of a scan is on its page."""

    samples: Annotated[int, "measured samples on the page"]
    interpolated_fraction: Annotated[float, "of the surface, without range data"]


class MeshReport(ResolutionReport, SampleReport):
    """What `describe` measures."""

    points: Annotated[int, "vertices of the flattened mesh"]
    method: Annotated[str, "flattening method"]
    dpi: Annotated[float, "pixels of the page for one inch of paper"]
    shading: Annotated[str, "keep or remove light and shadow"]
    iterations: Annotated[int, "iterations or time steps of the flattening"]
    flipped_faces: Annotated[int, "faces upside down on the page"]
    area_ratio: Annotated[float, "area of the flat mesh over that of the surface"]
    folded_faces: Annotated[int, "faces turned against their neighbours in space"]
    convergence: Annotated[ConvergenceReport, "how far the solver came"]
    strain: Annotated[StrainReport, "relative change of lengths by the flattening"]
    page_mm: Annotated[list[float], "width and height of the page"]
    decimation_error_mm: Annotated[DistanceReport, "depth between decimated mesh and surface; empty without a grid"]


class LightReport(TypedDict, total=False):
    removed: Annotated[bool, "whether light and shadow were removed"]
    reason: str
    corrected: Annotated[bool, "whether a residual corrects the fitted light"]
    regions_fraction: Annotated[float, "of the page, in regions of constant print"]
    lamps: Annotated[int, "lamps of the fitted light"]
    fitted_to: Annotated[str, "what the light was fitted to"]
    variation: Annotated[float, "rms of the logarithm of the light over the page"]
    standard_error: Annotated[float, "standard error of that logarithm, rms"]
    paper_fraction: Annotated[float, "of the page, bare paper"]
    unevenness_before: Annotated[float, "variation of bare paper before"]
    unevenness: Annotated[float, "variation of bare paper after"]
    illumination_gain: Annotated[dict[str, float], "factors of the correction: `min`, `max`"]


class WhiteReport(TypedDict, total=False):
    setting: Annotated[str, "`keep`, `paper` or `profile`"]
    balanced: Annotated[bool, "whether bare paper was made neutral"]
    reason: str
    paper: Annotated[list[int], "colour of bare paper before, sRGB codes"]
    paper_fraction: Annotated[float, "of the page, bare paper"]
    gains: Annotated[list[float], "factors of red, green and blue"]
    icc_profile: Annotated[str, "name of the ICC profile"]


class ShadeReport(TypedDict):
    light: Annotated[LightReport, "illumination correction; empty where it was not asked for"]
    white_balance: Annotated[WhiteReport, "colour of the light"]


class CoverageReport(TypedDict):
    measured: Annotated[float, "seen by the camera, shape measured"]
    interpolated: Annotated[float, "seen by the camera, shape interpolated"]
    occluded: Annotated[float, "not seen by the camera"]
    inpainted: Annotated[float, "occluded, and inpainted"]
    obstructed: Annotated[float, "covered by something in a photograph"]
    facing: Annotated[float, "of the facing page, next to the spine"]
    erased: Annotated[float, "removed by hand"]
    cropped_fraction: Annotated[float | None, "of the outline, at the edge of the image"]


class SizeReport(TypedDict):
    uncertainty_mm: NotRequired[Annotated[dict[str, Any], "standard deviations of places"]]
    calibration: Annotated[dict[str, Any], "calibration that points were computed with"]
    size_mm_ci95: Annotated[list[float] | None, "half of the 95 % intervals of width and height"]


class PhotoReport(ResolutionReport, total=False):
    """A photograph that was given."""

    name: str
    accepted: Annotated[bool, "whether a photograph is used"]
    reason: str
    size_px: Annotated[list[int], "width and height of a photograph"]
    residual_px: Annotated[float, "rms of the registration"]
    uncertainty_px: Annotated[float, "standard deviation of the registration"]
    match_fraction: Annotated[float, "of printed places, that match"]
    shown_fraction: Annotated[float, "of the page, in the photograph"]
    camera: Annotated[dict[str, Any], "camera of a photograph"]
    obstructed_fraction: Annotated[float, "of the page, obstructed in the photograph"]
    obstructed_mm2: Annotated[float, "area obstructed in the photograph"]
    textured_fraction: Annotated[float, "of the page, textured from the photograph"]


class PhotosReport(TypedDict, total=False):
    photos: Annotated[list[PhotoReport], "photographs that the page is textured from"]


class LayoutReport(TypedDict):
    advice: Annotated[str, "split, whole, left, right or ask"]
    is_spine: Annotated[str, "whether a valley is a spine: sure, unsure or no"]
    spine: Annotated[list[list[float]] | None, "points of the spine from head to tail, pixels or mm"]
    frame: Annotated[str, "picture or page: where the spine is given"]
    sigma_mm: Annotated[float | None, "standard deviation of the place of the spine"]
    turn_deg: Annotated[float | None, "turn of the surface across the spine"]
    beyond_deg: Annotated[float | None, "turn of the surface next to the spine"]
    bands: Annotated[float | None, "fraction of the height with the spine"]
    crossing: Annotated[float | None, "fraction of the height with print over the spine"]
    gutter_hidden_mm: Annotated[float | None, "least width of paper at the spine without range"]
    widths_mm: Annotated[list[float] | None, "width left and right of the spine"]
    reasons: Annotated[list[str], "why the advice is given"]


class LeafReport(TypedDict, total=False):
    """Which leaf of a scan the page is, and what was changed by hand."""

    part: Annotated[str, "left, right, or page for the whole"]
    layout: Annotated[LayoutReport, "layout of the scan as it was found"]
    leaf_mm: Annotated[list[float], "size of a leaf without the strip of the facing page"]
    rotation_deg: Annotated[int, "clockwise rotation of the page"]
    mirrored: Annotated[bool, "whether the page was mirrored"]
    given: Annotated[list[str], "sides placed by the given size"]
    edits: Annotated[dict[str, Any], "corrections by hand of the page"]


class Report(MeshReport, ShadeReport, PhotosReport, LeafReport, SizeReport):
    """The report of a page."""

    coverage: Annotated[CoverageReport, "fractions of the area of the page by kind of pixel"]
    source: Annotated[Mapping[str, Any], "provenance of the scan"]
    seconds: Annotated[dict[str, float], "time of each stage"]
    findings: Annotated[list[FindingReport], "notes, warnings and doubts about the page"]


ScaleReport = TypedDict(
    "ScaleReport",
    {
        "from": Annotated[str, "card, page or none"],
        "markers": Annotated[int, "markers of the card that were found"],
        "residual_mm": Annotated[float, "deviation of a registration"],
        "page_mm": Annotated[list[float], "width and height of the page"],
    },
    total=False,
)
"""Where the scale of photographs comes from."""


class AdjustmentReport(TypedDict):
    patches: Annotated[int, "patches that were tracked"]
    surface_points: Annotated[int, "measured points of the surface"]
    reprojection_px: Annotated[float, "rms of a bundle adjustment"]


class SurfaceReport(TypedDict):
    shape: Annotated[str, "smooth, pieces or facets"]
    stiffness_mm4: Annotated[float | None, "stiffness of the smooth surface"]
    smooth_pieces: Annotated[int | None, "smooth pieces between creases"]


class PhotogrammetryReport(SurfaceReport):
    """A page from photographs alone."""

    photographs_used: Annotated[list[str], "names of the photographs that were joined"]
    rejected: Annotated[dict[str, str], "what was not used, with the reason"]
    scale_source: Annotated[ScaleReport, "where the scale comes from"]
    surface_points: Annotated[int, "measured points of the surface"]
    edge_measured_fraction: Annotated[float, "of the page's edge, measured"]
    paper_outside_fraction: Annotated[float, "of the paper, beyond the page"]
    interpolated_fraction: Annotated[float, "of the surface, without range data"]
    surface_residual_mm: Annotated[float, "distance that one point in ten exceeds"]
    excess_area_fraction: Annotated[float | None, "area that paper cannot have"]
    gutter_width_range_mm: Annotated[float | None, "of the strip across a spine, from row to row"]
    adjustments: Annotated[list[AdjustmentReport], "bundle adjustments"]
