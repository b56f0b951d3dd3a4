"""`python -m bench.pictures shading|hidden|flattening [OUT]`: images of docs/, before and after.

shading  a bound figure and a crumpled letter under a desk lamp, as painted and with the light divided out.
hidden   a page pleated over itself: as the scanner saw it, what it could not see, and small holes filled on request.
flattening  eight frames of the particle system on a multi-fold sheet.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from bench.shading import DESK_LAMP, DPI, case
from drivers.simulated import Crumpled, Figure, MultiFold, Spread, Text, shoot
from drivers.simulated.imaging.shot import printed
from drivers.vivid900.geometry.lenses import LENSES
from restore import RestoredPage, Settings, SurfaceMesh, restore
from restore.scan import Bytes, Floats
from station.pictures.frames import Recorder, frames_sheet
from station.pictures.panels import Panel, resize_to_fit, side_by_side
from station.pictures.review import hatch_unseen

DOCS = Path(__file__).parent.parent / "docs" / "images"
HEIGHT, WIDTH = 280, 390  # of a panel
STEP = 4  # codes: noise that nobody sees takes most of the bytes
FOLDED_MM, GAP_MM, BACK_MM = 40.0, 4.0, 1.5  # where the pleat starts, how high it stands, how far it runs back
FILLED_MM = 8.0  # the pleat hides 6 mm


def main(what: str, path: Path | None = None) -> None:
    """Draw one of them."""
    picture = PICTURES[what]() // STEP * STEP + STEP // 2
    Image.fromarray(picture).save(path or DOCS / f"{what}.png", optimize=True)


def shading() -> Bytes:
    """Two pages, each with its light and without."""
    rows = [_shading_row(Spread(slope_deg=40.0), Figure(), "bound"), _shading_row(Crumpled(), Text(), "crumpled")]
    return np.concatenate(rows)


def _shading_row(sheet: Spread | Crumpled, artwork: Figure | Text, name: str) -> Bytes:
    lit_case = case(sheet, artwork, DESK_LAMP)
    kept, mask = lit_case.page(lit_case.seen)
    removed = lit_case.find_light().removed_from(kept, mask, DPI).image
    panels = ((kept, "The page with its light", f"a {name} page under a desk lamp"), (removed, "The light removed", ""))
    return side_by_side([Panel(resize_to_fit(image, height=HEIGHT, width=WIDTH), *words) for image, *words in panels])


def hidden() -> Bytes:
    """A page with a pleat: colour image, hidden places hatched, hidden places filled."""
    mesh = pleated()
    assert mesh.texture is not None
    unfilled, filled = (restore(mesh, Settings(points=0, inpaint_mm=mm)) for mm in (0.0, FILLED_MM))
    panels = [
        Panel(
            resize_to_fit(mesh.texture, height=HEIGHT, width=WIDTH),
            "As the camera saw it",
            "a pleat covers a strip",
        ),
        _panel(hatch_unseen(unfilled), unfilled, "Occluded places are marked", "occluded"),
        _panel(filled.image, filled, "Inpainted on request", "inpainted"),
    ]
    return side_by_side(panels)


def _panel(image: Bytes, page: RestoredPage, title: str, kind: str) -> Panel:
    return Panel(
        resize_to_fit(image, height=HEIGHT, width=WIDTH), title, f"{kind}: {page.report['coverage'][kind]:.1%}"
    )


def pleated() -> SurfaceMesh:
    """A printed page of 180 × 130 mm with a pleat across, seen by the colour camera."""
    page_mm = (180.0, 130.0)
    s, y = np.linspace(0, page_mm[0], 361), np.linspace(0, page_mm[1], 131)
    back = float(np.hypot(BACK_MM, GAP_MM))
    knots = [0.0, FOLDED_MM, FOLDED_MM + back, page_mm[0]]
    across = [0.0, FOLDED_MM, FOLDED_MM - BACK_MM, FOLDED_MM - BACK_MM + page_mm[0] - knots[2]]
    x, z = np.interp(s, knots, across), np.interp(s, knots, [0.0, 0.0, GAP_MM, GAP_MM])
    points = np.stack(np.broadcast_arrays(x - x.mean(), y[:, None] - y.mean(), z - 600.0), axis=-1).reshape(-1, 3)
    k = np.arange(points.shape[0]).reshape(len(y), len(s))
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[:-1, 1:], k[1:, :-1], k[1:, 1:]))
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    focal = LENSES["MIDDLE"].focal_px
    texcoords = points[:, :2] / -points[:, 2:] * [focal, -focal] + [319.5, 239.5]
    print_ = printed(Figure(caption_pt=12.0), page_mm).image
    flat = np.stack(np.broadcast_arrays(s, page_mm[1] - y[:, None]), axis=-1).reshape(-1, 2)
    return SurfaceMesh(points, faces, texcoords, _seen(points, faces, texcoords, flat, print_, page_mm))


def _seen(points: Floats, faces: Floats, texcoords: Floats, flat: Floats, print_: Bytes, page_mm: Floats) -> Bytes:
    """(480, 640, 3): the nearest paper on every line of sight."""
    from restore.mesh.raster import rasterise

    over = rasterise(texcoords, faces, flat, 480, 640, -1.0 / points[:, 2])
    scale = np.array(print_.shape[1::-1]) / page_mm
    at = np.nan_to_num(over * scale.astype(np.float32), nan=-9.0)
    smooth = cv2.GaussianBlur(print_, (0, 0), 1.2)  # the print has three pixels to one of the camera
    picture = cv2.remap(smooth, at, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=(70, 64, 58))
    return np.asarray(picture)


def flattening() -> Bytes:
    """Eight frames of the particle system, small."""
    scan, _ = shoot(MultiFold(), Text(), seed=3)
    recorder = Recorder()
    page = restore(scan, Settings(method="sticks"), on_step=recorder)
    frames = frames_sheet(recorder.frames(), page.flat)
    return resize_to_fit(frames, height=frames.shape[0] // 2, width=frames.shape[1] // 2)


PICTURES: dict[str, Callable[[], Bytes]] = {"shading": shading, "hidden": hidden, "flattening": flattening}

if __name__ == "__main__":
    main(sys.argv[1], *map(Path, sys.argv[2:]))
