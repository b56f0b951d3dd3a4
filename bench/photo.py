"""Photographs registered to scans, against exact projection; 24 megapixels timed; what is refused; a picture for docs.

`python -m bench.photo` prints the tables; `python -m bench.photo picture` draws docs/photograph.png.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from drivers.simulated import Binding, Crumpled, Curl, Figure, Miura, Pose, Spread, Text, Wave
from drivers.simulated.artwork import Artwork
from drivers.simulated.camera import Camera, Exposure, aim, take
from drivers.simulated.scene import Scene, lay
from drivers.simulated.sheets import Sheet
from drivers.simulated.shot import Truth, printed, shoot_scene
from drivers.vivid900.calibration import nominal
from drivers.vivid900.lenses import LENSES, MODES
from restore import FlatMesh, Photograph, RangeScan, Settings, restore
from restore.formats import save_scan
from restore.photo.reference import make_reference
from restore.photo.register import Refused, Registration, register
from restore.pipeline import Stopwatch
from restore.prepare import prepare
from restore.scan import Bytes, Floats
from restore.unroll import unroll

A4 = (297.0, 210.0)
DISTANCE_MM, LENS = 900.0, LENSES["MIDDLE"]
PAGE = np.array([0.0, 0.0, -DISTANCE_MM - LENS.pupil_mm])  # the middle of the page
SEED = 3
SMALL, LARGE = (2000, 1333), (6000, 4000)
PRINT_DPI = 600  # finer than the photograph sees
SHEETS: dict[str, Sheet] = {
    "curl": Curl(),
    "wave": Wave(),
    "binding": Binding(),
    "Miura fold": Miura(),
    "deep gutter": Spread(slope_deg=66.0),
    "crumpled": Crumpled(),
}
ARTWORK: dict[str, Artwork] = {"text": Text(), "figure": Figure()}
LIMIT_PX = 1.5
DAYLIGHT = Exposure(colour=(1.0, 0.99, 0.97), exposure=1.0)
SMALL_PRINT = Text(sizes_pt=(10.0, 8.0, 7.0, 6.0), title_pt=16.0, dpi=PRINT_DPI)


@dataclass(frozen=True)
class View:
    """Where a camera stands from the middle of the page, mm right, up and towards the scanner, and how it is held.

    focal: in widths of the picture; k1, k2: radial distortion.
    """

    place: tuple[float, float, float]
    focal: float
    roll_deg: float
    k1: float
    k2: float

    def camera(self, size: tuple[int, int], *, tangential: float = 0.001, offset: float = 0.004) -> Camera:
        """The camera for a size (w, h), its lens a little askew."""
        return aim(
            PAGE, PAGE + self.place, size=size, focal_px=self.focal * size[0], roll_deg=self.roll_deg,
            offset=(offset * size[0], -0.75 * offset * size[0]), radial=(self.k1, self.k2, 0.0),
            tangential=(tangential, -0.7 * tangential),
        )  # fmt: skip


VIEWS = {
    "above": View((20.0, -30.0, 500.0), 1.45, 2.0, -0.12, 0.08),
    "from the left": View((-250.0, 60.0, 520.0), 1.45, -15.0, -0.12, 0.08),
    "phone, held upright": View((60.0, -200.0, 560.0), 1.2, 93.0, 0.05, -0.03),
    "long lens": View((150.0, 250.0, 1500.0), 4.0, 5.0, 0.1, 0.0),
}
# For 24 megapixels the page fills the picture, as anyone would have it.
FILLING = View((15.0, -20.0, 660.0), 2.02, 0.5, -0.08, 0.05)


@cache
def staged(sheet: Sheet, artwork: Artwork) -> tuple[Scene, RangeScan, Truth]:
    """A page before the scanner, and its scan."""
    depth = DISTANCE_MM + LENS.pupil_mm
    scene = lay(sheet, printed(artwork, A4), depth_mm=depth, pose=Pose(tilt_deg=3.0))
    scan, truth = shoot_scene(scene, nominal(LENS), MODES["fine"], DISTANCE_MM, np.random.default_rng(SEED))
    return scene, scan, truth


@cache
def unrolled(sheet: Sheet, artwork: Artwork) -> FlatMesh:
    """The fine mesh of the restored page."""
    return unroll(prepare(staged(sheet, artwork)[1]), Settings(), Stopwatch(None)).fine


def photographed(scene: Scene, camera: Camera, *, seed: int = SEED, exposure: Exposure | None = None) -> Bytes:
    """The scene through a camera, by the light of a window."""
    return take(scene, camera, exposure or Exposure(), np.random.default_rng(seed))


def misses(page: FlatMesh, truth: Truth, camera: Camera, found: Registration) -> Floats:
    """(n,) pixels between where the scanner's lines of sight lie in the photograph and where the registration says.

    For every pixel of the scanner's image that shows the page: the exact surface point through the exact camera, and
    the measured surface point through the camera that was found.
    """
    reference = make_reference(page)
    told = found.camera.project(reference.points.reshape(-1, 3).astype(float)).reshape(*reference.page.shape, 2)
    exact = camera.project(truth.points)
    on_page = np.isfinite(truth.flat[..., 0]) & reference.page
    within = ((exact >= 0) & (exact <= np.array(camera.size) - 1)).all(axis=2)
    distance = np.linalg.norm(told - exact, axis=2)[on_page & within]
    return np.asarray(distance[np.isfinite(distance)])


def main() -> None:
    """Print the tables."""
    print(f"registration of {SMALL[0]} × {SMALL[1]} photographs, pixels off the exact projection, limit {LIMIT_PX} rms")
    row = "{:<12}{:<8}{:<21}{:>7}{:>7}{:>10}{:>8}{:>8}"
    print(row.format("sheet", "print", "camera", "rms", "99 %", "residual", "alike", "focal"))
    for sheet_name, sheet in SHEETS.items():
        for art_name, artwork in ARTWORK.items():
            for view_name, view in VIEWS.items():
                cells = _registration(sheet, artwork, view.camera(SMALL))
                print(row.format(sheet_name, art_name, view_name, *cells), flush=True)
    _refusals()
    _large()


def _registration(sheet: Sheet, artwork: Artwork, camera: Camera) -> tuple[str, ...]:
    scene, _, truth = staged(sheet, artwork)
    page = unrolled(sheet, artwork)
    try:
        found = register(make_reference(page), Photograph(photographed(scene, camera)))
    except Refused as refusal:
        return "refused", "", "", "", str(refusal)
    off = misses(page, truth, camera, found)
    figures = float(np.sqrt(np.mean(off**2))), float(np.percentile(off, 99)), found.residual_px
    focal = f"{found.camera.focal_px / camera.focal_px - 1:+.1%}"
    return *(f"{figure:.2f}" for figure in figures), f"{found.alike:.0%}", focal


def _refusals() -> None:
    print("\nwhat is refused")
    scene, _, _ = staged(SHEETS["binding"], ARTWORK["text"])
    reference = make_reference(unrolled(SHEETS["binding"], ARTWORK["text"]))
    camera = VIEWS["above"].camera(SMALL)
    right = photographed(scene, camera)
    other = photographed(staged(SHEETS["binding"], Text(seed=9))[0], camera)
    black = np.zeros_like(right)
    flipped = np.ascontiguousarray(right[:, ::-1])
    for name, image in {"right": right, "other page": other, "black": black, "mirrored": flipped}.items():
        try:
            register(reference, Photograph(image))
            print(f"{name:<12} accepted")
        except Refused as refusal:
            print(f"{name:<12} refused: {refusal}")


def _large() -> None:
    """Time and memory of the command for 24 megapixels, in a process of its own."""
    report, wall, seconds, off = _restored_large()
    photo = report["photos"][0]
    print(f"\n{LARGE[0]} × {LARGE[1]} photograph, A4 at 400 dpi, `planish restore --photo`")
    print(f"registration {np.sqrt(np.mean(off**2)):.2f} pixels rms, 99 % within {np.percentile(off, 99):.2f}")
    print(f"effective ppi {photo['effective_ppi']:.0f} from the photograph, painted {photo['painted_share']:.1%}")
    stages = ", ".join(f"{stage} {taken:.2f}" for stage, taken in report["seconds"].items())
    print(f"seconds: {stages}")
    print(f"with start and files {wall:.1f} s by the clock, {seconds:.1f} s of the processor's time")
    print(f"peak memory {report['peak_memory_mb']:.0f} MB")


def _restored_large() -> tuple[Mapping[str, Any], float, float, Floats]:
    """Its report, seconds by the clock and of the processor, and the misses of the registration."""
    sheet = SHEETS["binding"]
    scene, scan, truth = staged(sheet, SMALL_PRINT)
    camera = FILLING.camera(LARGE)
    image = photographed(scene, camera)
    with tempfile.TemporaryDirectory() as folder:
        photo, stored, out = (Path(folder) / name for name in ("photo.jpg", "page.scan", "out"))
        Image.fromarray(image).save(photo, quality=92)
        stored.mkdir()
        save_scan(scan, stored)
        # Through a shell: a process starts with the peak memory of the one that started it, and this one is large.
        command = ["sh", "-c", '"$@"; exit $?', "sh", sys.executable, "-m", "station", "restore", str(stored)]
        command += ["--photo", str(photo), "--dpi", "400"]
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        done = subprocess.run([*command, "--json", "-o", str(out)], capture_output=True, text=True, check=True)
        after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - start
    page = unrolled(sheet, SMALL_PRINT)
    found = register(make_reference(page), Photograph(image))
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return json.loads(done.stdout), wall, seconds, misses(page, truth, camera, found)


def picture(target: Path) -> None:
    """Draw small print as the scanner's image and as a photograph give it, side by side."""
    scene, scan, _ = staged(SHEETS["binding"], SMALL_PRINT)
    image = photographed(scene, FILLING.camera(LARGE), exposure=DAYLIGHT)
    settings = Settings(dpi=400.0, shading="remove")
    pages = [restore(scan, settings), restore(scan, settings, photos=[replace(Photograph(image), name="24 MP")])]
    height, width = pages[0].image.shape[:2]
    rows, cols = slice(int(0.30 * height), int(0.48 * height)), slice(int(0.035 * width), int(0.225 * width))
    captions = (
        f"painted from the scanner's image: {pages[0].report['effective_ppi']:.0f} ppi",
        f"painted from a photograph: {pages[1].report['effective_ppi']:.0f} ppi",
    )
    crops = [_captioned(page.image[rows, cols], text) for page, text in zip(pages, captions, strict=True)]
    gap = np.full((crops[0].shape[0], 16, 3), 255, np.uint8)
    Image.fromarray(np.hstack([crops[0], gap, crops[1]])).save(target)


def _captioned(crop: Bytes, text: str) -> Bytes:
    from drivers.simulated.artwork.typeset import typeface

    board = Image.new("RGB", (crop.shape[1], crop.shape[0] + 44), "white")
    board.paste(Image.fromarray(crop), (0, 44))
    ImageDraw.Draw(board).text((4, 8), text, fill="black", font=typeface("sans", 6.0))
    return np.asarray(board)


if __name__ == "__main__":
    if sys.argv[1:] == ["picture"]:
        picture(Path(__file__).parent.parent / "docs" / "photograph.png")
    else:
        main()
