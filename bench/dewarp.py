"""`python -m bench.dewarp`: page-dewarp on a single picture against the restoration of the scan.

The program page-dewarp (M. Zucker's method: the bend of a page from its lines of text) gets the colour image of a
page of each warp, three times enlarged, as it finds no text in 53 pixels to the inch. What it makes of it is fitted to
the flat original by the best affine map, of which ours needs none. It wants another build of OpenCV than Planish does,
so that it lives in an environment of its own, made at the first run.
"""

from __future__ import annotations

import subprocess
import tempfile
import time
import venv
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from bench.words import COLUMNS, DPI, WARPS, Task, pictures, tasks
from oracles.similarity import page_similarity
from restore.scan import Bytes
from station.words.ocr_precision import count_matching_words
from station.words.words import ProgramMissing, find_tesseract, recognise

HOME = Path("build") / "page-dewarp"
ENLARGED = 3
TIMEOUT_S = 300.0
SEED = 20  # of the pages
ROW = "{:<14}{:>10}{:>10}{:>12}{:>12}{:>12}{:>12}"


def main() -> None:
    """Print words read in per cent and MS-SSIM, page-dewarp's and ours, for the first page of every warp."""
    try:
        find_tesseract()
        program = installed()
    except (ProgramMissing, subprocess.CalledProcessError) as missing:
        print(f"dewarp: {missing}")
        return
    print("one image (page-dewarp) next to the scan: words read, per cent, and MS-SSIM with the flat original")
    print(ROW.format("warp", "seconds", "raw words", "its words", "its MS-SSIM", "our words", "our MS-SSIM"))
    for warp in WARPS:
        task = next(task for task in tasks(SEED) if task.warp == warp)
        print(ROW.format(warp, *_compare(task, program)), flush=True)


def installed() -> Path:
    """The program, installed on first use."""
    program = HOME / "bin" / "page-dewarp"
    if not program.exists():
        venv.create(HOME, with_pip=True)
        command = [HOME / "bin" / "python", "-m", "pip", "install", "--quiet", "page-dewarp"]
        subprocess.run(command, check=True, capture_output=True)
    return program.resolve()


def _compare(task: Task, program: Path) -> tuple[str, ...]:
    page = pictures(task)
    raw, restored, flat = (page.images[name] for name in (COLUMNS[0], COLUMNS[2], COLUMNS[3]))
    start = time.perf_counter()
    theirs = run_page_dewarp(raw, program)
    seconds = time.perf_counter() - start

    def words(image: Bytes, dpi: float, name: str) -> str:
        return f"{100 * count_matching_words(page.text, recognise(image, dpi, name=name).text).precision:.1f}"

    before, ours = words(raw, page.dpi[COLUMNS[0]], "raw"), words(restored, DPI, "ours")
    similarity = f"{page_similarity(restored, flat):.3f}"
    if theirs is None:
        return f"{seconds:.1f}", before, "gives up", "", ours, similarity
    its = words(theirs, ENLARGED * page.dpi[COLUMNS[0]], "theirs")
    return f"{seconds:.1f}", before, its, f"{page_similarity(fit_affine(theirs, flat), flat):.3f}", ours, similarity


def run_page_dewarp(image: Bytes, program: Path) -> Bytes | None:
    """Output of page-dewarp for a picture (h, w, 3), None when it detects no text."""
    with tempfile.TemporaryDirectory() as folder:
        large = Image.fromarray(image)
        large.resize((ENLARGED * large.width, ENLARGED * large.height), Image.Resampling.LANCZOS).save(
            Path(folder, "page.png")
        )
        command = [program, "--no-binary", "1", "page.png"]
        subprocess.run(command, cwd=folder, check=False, capture_output=True, timeout=TIMEOUT_S)
        outputs = sorted(Path(folder).glob("page_*.png"))
        return np.asarray(Image.open(outputs[0]).convert("RGB")) if outputs else None


def fit_affine(page: Bytes, flat: Bytes) -> Bytes:
    """The page (h, w, 3) by the affine map that brings it nearest to its flat original (H, W, 3)."""
    height, width = flat.shape[:2]
    scaled = cv2.resize(page, (width, height), interpolation=cv2.INTER_AREA)
    grey, other = (cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for picture in (flat, scaled))
    ending = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 300, 1e-6)
    start = np.eye(2, 3, dtype=np.float32)
    try:
        _, transform = cv2.findTransformECC(grey, other, start, cv2.MOTION_AFFINE, ending, None, 11)
    except cv2.error:  # it comes no nearer
        return np.asarray(scaled)
    how = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(scaled, transform, (width, height), flags=how, borderMode=cv2.BORDER_REPLICATE))


if __name__ == "__main__":
    main()
