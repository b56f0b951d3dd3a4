"""Photographs registered to scans, against exact projection; 24 megapixels timed; refusals; a picture for docs.

`python -m bench.photo` prints the tables; `python -m bench.photo picture` draws docs/images/photograph.png.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from drivers.simulated import Text
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.sheets import Sheet
from oracles.simulation.camera import Camera, Exposure
from oracles.studio import (
    ARTWORK,
    LIMIT_PX,
    SHEETS,
    VIEWS,
    View,
    reprojection_errors,
    restored_mesh,
    scan_page,
    take_photograph,
)
from restore import Photograph, Settings, restore
from restore.formats import save_scan
from restore.photo.reference import make_reference
from restore.photo.register import Refused, register
from restore.scan import Bytes, Floats

SMALL, LARGE = (2000, 1333), (6000, 4000)
PRINT_DPI = 600  # finer than the photograph sees
DAYLIGHT = Exposure(colour=(1.0, 0.99, 0.97), exposure=1.0)
SMALL_PRINT = Text(sizes_pt=(10.0, 8.0, 7.0, 6.0), title_pt=16.0, dpi=PRINT_DPI)


# For 24 megapixels the page fills the picture, as anyone would have it.
FILLING = View((15.0, -20.0, 660.0), 2.02, 0.5, -0.08, 0.05)


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
    scene, _, truth = scan_page(sheet, artwork)
    page = restored_mesh(sheet, artwork)
    try:
        registration = register(make_reference(page), Photograph(take_photograph(scene, camera)))
    except Refused as refusal:
        return "refused", "", "", "", str(refusal)
    errors_px = reprojection_errors(page, truth, camera, registration)
    figures = float(np.sqrt(np.mean(errors_px**2))), float(np.percentile(errors_px, 99)), registration.residual_px
    focal = f"{registration.camera.focal_px / camera.focal_px - 1:+.1%}"
    return *(f"{figure:.2f}" for figure in figures), f"{registration.match_fraction:.0%}", focal


def _refusals() -> None:
    print("\nwhat is refused")
    scene, _, _ = scan_page(SHEETS["binding"], ARTWORK["text"])
    reference = make_reference(restored_mesh(SHEETS["binding"], ARTWORK["text"]))
    camera = VIEWS["above"].camera(SMALL)
    correct = take_photograph(scene, camera)
    other = take_photograph(scan_page(SHEETS["binding"], Text(seed=9))[0], camera)
    black = np.zeros_like(correct)
    flipped = np.ascontiguousarray(correct[:, ::-1])
    for name, image in {"right": correct, "other page": other, "black": black, "mirrored": flipped}.items():
        try:
            register(reference, Photograph(image))
            print(f"{name:<12} accepted")
        except Refused as refusal:
            print(f"{name:<12} refused: {refusal}")


def _large() -> None:
    """Time and memory of the command for 24 megapixels, in a process of its own."""
    report, wall, seconds, errors_px = _restored_large()
    photo = report["photos"][0]
    print(f"\n{LARGE[0]} × {LARGE[1]} photograph, A4 at 400 dpi, `planish restore --photo`")
    print(
        f"registration {np.sqrt(np.mean(errors_px**2)):.2f} pixels rms, 99 % within {np.percentile(errors_px, 99):.2f}"
    )
    print(f"{photo['sampling_ppi']:.0f} pixels per inch from the photograph, painted {photo['textured_fraction']:.1%}")
    print(f"effective ppi {photo['resolved_ppi'] or float('nan'):.0f}")
    stages = ", ".join(f"{stage} {taken:.2f}" for stage, taken in report["seconds"].items())
    print(f"seconds: {stages}")
    print(f"with start and files {wall:.1f} s by the clock, {seconds:.1f} s of the processor's time")
    print(f"peak memory {report['peak_memory_mb']:.0f} MB")


def _restored_large() -> tuple[Mapping[str, Any], float, float, Floats]:
    """Its report, seconds by the clock and of the processor, and the reprojection errors of the registration."""
    sheet = SHEETS["binding"]
    scene, scan, truth = scan_page(sheet, SMALL_PRINT)
    camera = FILLING.camera(LARGE)
    image = take_photograph(scene, camera)
    with tempfile.TemporaryDirectory() as folder:
        photo, scan_folder, out = (Path(folder) / name for name in ("photo.jpg", "page.scan", "out"))
        Image.fromarray(image).save(photo, quality=92)
        scan_folder.mkdir()
        save_scan(scan, scan_folder)
        # Through a shell: a process starts with the peak memory of the one that started it, and this one is large.
        command = ["sh", "-c", '"$@"; exit $?', "sh", sys.executable, "-m", "station", "restore", str(scan_folder)]
        command += ["--photo", str(photo), "--dpi", "400"]
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        done = subprocess.run([*command, "--json", "-o", str(out)], capture_output=True, text=True, check=True)
        after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - start
    page = restored_mesh(sheet, SMALL_PRINT)
    registration = register(make_reference(page), Photograph(image))
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return json.loads(done.stdout), wall, seconds, reprojection_errors(page, truth, camera, registration)


def picture(target: Path) -> None:
    """Draw small print as the scanner's image and as a photograph give it, side by side."""
    scene, scan, _ = scan_page(SHEETS["binding"], SMALL_PRINT)
    image = take_photograph(scene, FILLING.camera(LARGE), exposure=DAYLIGHT)
    settings = Settings(dpi=400.0, shading="remove")
    pages = [restore(scan, settings), restore(scan, settings, photos=[replace(Photograph(image), name="24 MP")])]
    height, width = pages[0].image.shape[:2]
    rows, cols = slice(int(0.30 * height), int(0.48 * height)), slice(int(0.035 * width), int(0.225 * width))
    captions = (
        f"painted from the scanner's image: {pages[0].report['sampling_ppi']:.0f} ppi",
        f"painted from a photograph: {pages[1].report['sampling_ppi']:.0f} ppi",
    )
    crops = [_captioned(page.image[rows, cols], text) for page, text in zip(pages, captions, strict=True)]
    gap = np.full((crops[0].shape[0], 16, 3), 255, np.uint8)
    Image.fromarray(np.hstack([crops[0], gap, crops[1]])).save(target)


def _captioned(crop: Bytes, text: str) -> Bytes:
    from drivers.simulated.scene.artwork.typeset import typeface

    board = Image.new("RGB", (crop.shape[1], crop.shape[0] + 44), "white")
    board.paste(Image.fromarray(crop), (0, 44))
    ImageDraw.Draw(board).text((4, 8), text, fill="black", font=typeface("sans", 6.0))
    return np.asarray(board)


if __name__ == "__main__":
    if sys.argv[1:] == ["picture"]:
        picture(Path(__file__).parent.parent / "docs" / "images" / "photograph.png")
    else:
        main()
