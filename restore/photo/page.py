"""The page textured from photographs of it.

Each is registered to the scan, or refused with the reason.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from restore.errors import BadInput
from restore.findings import Finding
from restore.mesh.measures import signed_areas
from restore.mesh.raster import rasterise
from restore.numerics.robust import MAJORITY
from restore.page import FlatMesh
from restore.photo.coarse import COARSE_MM
from restore.photo.obstructions import RIM_MM
from restore.photo.paint import enlarged, paint
from restore.photo.photograph import Photograph
from restore.photo.reference import Reference, make_reference
from restore.photo.register import Refused, Registration, register
from restore.photo.sources import Plan, Source, plan
from restore.report import PhotoReport
from restore.runtime.threads import in_threads
from restore.scan import Bytes, Floats, Ints, Mask
from restore.texture.page import Painting, extend_edge_colours, paint_page
from restore.texture.resolution import Resolution, print_or_outline_mtf50


@dataclass(frozen=True, eq=False)
class Registered:
    """Photograph with its registration, or the reason why it has none.

    The reason says what to do about it.
    mtf50: of its edges on the page, cycles per pixel, None where it has too few to measure it.
    """

    photograph: Photograph
    registration: Registration | None
    reason: str = ""
    hint: str = ""
    mtf50: float | None = None


def register_photographs(page: FlatMesh, photos: Sequence[Photograph | Bytes]) -> list[Registered]:
    """Register photographs to the colour image of a flat page's surface.

    Photographs are (h, w, 3) where they are arrays. A known camera is kept as it is. Raises BadInput for an array that
    is not a picture.
    """
    photographs = [_photograph(photo, number) for number, photo in enumerate(photos, 1)]
    unknown = any(photograph.camera is None for photograph in photographs)
    textured = page.texture is not None and page.texcoords is not None
    reference = make_reference(page) if unknown and textured else None
    registered = [_register(reference, photograph) for photograph in photographs]
    return in_threads(lambda one: _with_edges(page, one), registered)


def _register(reference: Reference | None, photograph: Photograph) -> Registered:
    """Register a photograph to the reference of a page.

    Returns None for a page without texture.
    """
    try:
        found = _known(photograph) if photograph.camera is not None else register(_insist_on(reference), photograph)
    except Refused as refusal:
        return Registered(photograph, None, str(refusal), refusal.hint)
    return Registered(photograph, found)


def _with_edges(page: FlatMesh, one: Registered) -> Registered:
    """A registered photograph with its edges on the page measured; others as they are."""
    return one if one.registration is None else replace(one, mtf50=_mtf50(page, one.photograph, one.registration))


def _insist_on(reference: Reference | None) -> Reference:
    if reference is None:
        raise Refused("the scan has no colour image to compare it with", "")
    return reference


def _known(photograph: Photograph) -> Registration:
    """Return the registration of a photograph whose camera is known.

    Nothing of it was measured here.
    """
    assert photograph.camera is not None
    return Registration(photograph.camera, 0.0, 0.0, 1.0, 1.0, 1.0)


def _photograph(photo: Photograph | Bytes, number: int) -> Photograph:
    photograph = photo if isinstance(photo, Photograph) else Photograph(photo, f"photograph {number}")
    image = np.asarray(photograph.image)
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or min(image.shape) == 0:
        raise BadInput(f"{photograph.name} is not an RGB image", "give an array (h, w, 3) of uint8")
    return photograph


def paint_registered(
    page: FlatMesh, registered: Sequence[Registered], dpi: float
) -> tuple[Painting, list[PhotoReport]]:
    """Texture a flat page from registered photographs, and report on all.

    Without any it is textured from its scan. In the result, source 0 is the scan's texture and k the k-th photograph.
    """
    reports = [_refusal(one) if one.registration is None else _acceptance(one, one.registration) for one in registered]
    accepted = [(k, one) for k, one in enumerate(registered, 1) if one.registration is not None]
    if not accepted or page.texture is None or page.texcoords is None:
        return paint_page(page, dpi), reports
    sources = sources_of(page, registered)
    planned = plan(page, sources)
    painting = paint(page, sources, planned, dpi)
    assert painting.page_source is not None
    best, number_of = np.argmax(planned.weights, axis=0), np.arange(256).astype(np.uint8)
    for index, (number, _) in enumerate(accepted, 1):
        reports[number - 1] = {**reports[number - 1], **_use(planned, sources[index], best == index, index)}
        number_of[index] = number
    rows, cols = painting.mask.shape
    covered = enlarged(np.asarray(planned.covered.any(axis=0), np.float32), 0, rows, cols, dpi) > MAJORITY
    page_source = number_of[painting.page_source]
    return replace(painting, page_source=page_source, covered=covered & painting.mask), reports


def sources_of(page: FlatMesh, registered: Sequence[Registered]) -> list[Source]:
    """Return what a page can be textured from.

    Its scan's texture, and the photographs that are registered.
    """
    if page.texture is None or page.texcoords is None:
        return []
    photographs = [
        Source(one.photograph.image, one.registration.camera, one.mtf50) for one in registered if one.registration
    ]
    return [Source(extend_edge_colours(page.texture, page.texcoords, page.faces)), *photographs]


def _mtf50(page: FlatMesh, photograph: Photograph, found: Registration) -> float | None:
    pixels = found.camera.project(page.vertices)
    shown = _shown(pixels, page.faces, photograph.image.shape[:2])
    areas = signed_areas(pixels, page.faces), page.areas
    seen = np.isfinite(areas[0]) & (areas[1] != 0)
    if not shown.any() or not seen.any():
        return None
    pixels_per_mm = float(np.sqrt(np.median(np.abs(areas[0][seen] / areas[1][seen]))))
    return print_or_outline_mtf50(photograph.image, shown, RIM_MM * pixels_per_mm)


def _shown(pixels: Floats, faces: Ints, shape: tuple[int, ...]) -> Mask:
    """Return where triangles cover a picture of a shape, (h, w) bool.

    pixels: (n, 2), corners.
    faces: (m, 3).
    """
    seen = faces[np.isfinite(pixels[faces]).all(axis=(1, 2))]
    return np.isfinite(rasterise(pixels, seen, np.zeros((len(pixels), 1)), shape[0], shape[1])[..., 0])


def photo_findings(registered: Sequence[Registered], reports: Sequence[PhotoReport]) -> list[Finding]:
    """Why photographs are not used, or not in full, and what to do about it.

    reports: those that `paint_registered` gave.
    """
    refused = [
        Finding.of("photo_refused", name=one.photograph.name, reason="; ".join(filter(None, (one.reason, one.hint))))
        for one in registered
        if one.registration is None
    ]
    covered = [
        Finding.of("photo_covered", one["obstructed_fraction"], name=one["name"], area_cm2=one["obstructed_mm2"] / 100)
        for one in reports
        if one.get("obstructed_mm2", 0.0) > 0
    ]
    return refused + covered


def _refusal(one: Registered) -> PhotoReport:
    return {"name": one.photograph.name, "accepted": False, "reason": one.reason}


def _acceptance(one: Registered, found: Registration) -> PhotoReport:
    height, width = one.photograph.image.shape[:2]
    return {
        "name": one.photograph.name,
        "accepted": True,
        "size_px": [width, height],
        "residual_px": found.residual_px,
        "uncertainty_px": found.uncertainty_px,
        "match_fraction": found.match_fraction,
        "shown_fraction": found.coverage,
        "camera": found.camera.described(),
    }


def _use(planned: Plan, source: Source, here: Mask, index: int) -> PhotoReport:
    """What the source `index` gave to the page, where it gave most (h, w)."""
    seen = here & (planned.ppi[index] > 0)
    covered = planned.covered[index] & (planned.ppi[0] > 0)
    return {
        "obstructed_fraction": float(covered.sum() / max((planned.ppi[0] > 0).sum(), 1)),
        "obstructed_mm2": float(covered.sum() * COARSE_MM**2),
        "textured_fraction": float(seen.sum() / max((planned.ppi[0] > 0).sum(), 1)),
        **Resolution(float(np.median(planned.ppi[index][seen])) if seen.any() else 0.0, source.mtf50).described(),
    }
