"""The pictures of docs/how-to/ocr.md: `python -m bench.figures words|colour|super OUT.png`."""

from __future__ import annotations

import argparse
import io
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
from PIL import Image, ImageCms, ImageDraw
from rapidfuzz.distance import Levenshtein

from bench import small_print
from bench.words import pictures, tasks
from drivers.simulated import Chart, Flat, Truth, shoot
from drivers.simulated.scene.albedo import linear, srgb
from drivers.simulated.scene.artwork.typeset import typeface
from drivers.vivid900.geometry.lenses import LENSES
from restore import Settings, restore
from restore.scan import Bytes
from restore.texture.page import MM_PER_INCH
from restore.texture.super_resolution import super_resolve
from station.colour.chart import find_chart
from station.colour.figures import mean_differences
from station.colour.fit import fit_colours
from station.images.icc import encode_profile, srgb_profile
from station.words.ocr_precision import count_matching_characters, count_matching_words
from station.words.words import recognise

PAPER, INK, WRONG = (255, 255, 255), (40, 40, 40), (200, 30, 30)
SEED = 20  # of the page that is read
GAP = 16  # pixels
CAPTION_PT, WORDS_PT = 4.6, 4.2  # at 300 dpi, as typefaces are made here: 19 and 17 pixels
GREYS = 96  # of the palette: a page of print needs no more, and the file is a third as large
SHOWN_WORDS, SHOWN_FRACTION = 75, 0.6
# A camera with overlapping filters by warm light: what it makes of linear sRGB.
CAMERA = np.array([[0.86, 0.14, 0.04], [0.10, 0.72, 0.08], [0.02, 0.16, 0.50]])
SHOTS, SMALL_PT = 4, 9.0
CUT_FRACTION, CUT_ROWS = 0.04, 5  # of the height: two lines of print; rows of bare paper


def words_figure() -> Image.Image:
    """A rumpled page as the scanner saw it and restored without its light, with what Tesseract reads in each."""
    seen = pictures(next(task for task in tasks(SEED) if task.warp == "rumples"))
    titles = {"raw": "as the scanner saw it", "light removed": "restored, light removed"}
    panels = []
    for name, title in titles.items():
        image, dpi = seen.images[name], seen.dpi[name]
        read = recognise(image, dpi, name=name).text
        share = f"{100 * count_matching_words(seen.text, read).precision:.0f} % of the words read right"
        picture = resize(image[: between_lines(image, SHOWN_FRACTION)], 620 / image.shape[1])
        panels.append(stack([caption(f"{title}: {share}", 620), picture, draw_recognised_words(read, seen.text, 620)]))
    return side_by_side(panels)


def colour_figure() -> Image.Image:
    """A chart by a camera of its own colours, before and after its profile; the true colour in each patch's middle."""
    scan, truth = shoot(Flat(), Chart())
    assert scan.texture is not None
    codes = srgb(linear(scan.texture.astype(np.float32)) @ CAMERA.T.astype(np.float32)).round().astype(np.uint8)
    fit = fit_colours(find_chart(codes))
    profiles = (
        ImageCms.ImageCmsProfile(io.BytesIO(data)) for data in (encode_profile(fit.profile("camera")), srgb_profile())
    )
    after = np.asarray(ImageCms.profileToProfile(Image.fromarray(codes), *profiles))
    errors = mean_differences(fit)
    titles = [f"{how}: mean ΔE2000 {error:.1f}" for how, error in errors.items()]
    panels = []
    for title, picture in zip(titles, (codes, after), strict=True):
        panels.append(stack([caption(title, 384), resize(with_truth(picture, truth), 0.6)]))
    return side_by_side(panels)


def super_figure() -> Image.Image:
    """Small print restored from one shot, and from several."""
    config = small_print.station(SMALL_PT)
    taken, text = small_print.shots(config, SHOTS), small_print.printed(config)
    panels = []
    for title, scan in (("one capture", taken[0]), (f"{SHOTS} captures", super_resolve(taken))):
        page = restore(scan, Settings(shading="remove")).image
        read = recognise(page, 150.0, name=title).text
        right = f"{100 * count_matching_characters(text, read).precision:.1f} % of the characters read right"
        part = page[: between_lines(page, 0.38), : page.shape[1] // 2]
        panels.append(stack([caption(f"{title}, {SMALL_PT:g} pt: {right}", part.shape[1]), Image.fromarray(part)]))
    return side_by_side(panels)


def between_lines(image: Bytes, share: float) -> int:
    """The row next to a share of the height with the least ink round it: there a picture is cut between lines."""
    near, reach = round(share * len(image)), round(CUT_FRACTION * len(image))
    middle = image[near - reach : near + reach, image.shape[1] // 8 : image.shape[1] // 2].mean(axis=2)
    ink = cv2.blur(middle.std(axis=1)[:, None], (1, CUT_ROWS)).ravel()
    return near - reach + int(np.argmin(ink))


def with_truth(picture: Bytes, truth: Truth) -> Bytes:
    """The picture of a chart with the printed colour in the middle of every patch."""
    shown, lens = picture.copy(), LENSES["MIDDLE"]
    scale = MM_PER_INCH / 300
    for left, bottom, right, top in truth.printed.patches.values():
        x, y = (left + right) / 2, (bottom + top) / 2
        row, col = round((truth.page_mm[1] - y) / scale), round(x / scale)
        place = truth.surface(np.array([x, y]))
        px, py = (place[:2] / -place[2] * [1, -1] * lens.focal_px + [319.5, 239.5]).round().astype(int)
        shown[py - 12 : py + 13, px - 12 : px + 13] = truth.printed.image[row, col]
    return shown


def caption(text: str, width: int) -> Image.Image:
    """A line of text."""
    strip = Image.new("RGB", (width, 30), PAPER)
    ImageDraw.Draw(strip).text((0, 4), text, fill=INK, font=typeface("sans-bold", CAPTION_PT))
    return strip


def draw_recognised_words(read: str, printed: str, width: int) -> Image.Image:
    """The beginning of what was read, words that are not as printed in red."""
    words, font, line = read.split(), typeface("sans", WORDS_PT), 23
    wrong = {
        i
        for step in Levenshtein.opcodes(printed.split(), words)
        if step.tag != "equal"
        for i in range(step.dest_start, step.dest_end)
    }
    strip = Image.new("RGB", (width, 8 * line), PAPER)
    pen, x, y = ImageDraw.Draw(strip), 0.0, 4
    for i, word in enumerate(words[:SHOWN_WORDS]):
        if x + font.getlength(word) > width:
            x, y = 0.0, y + line
        pen.text((x, y), word, fill=WRONG if i in wrong else INK, font=font)
        x += font.getlength(word + " ")
    return strip.crop((0, 0, width, y + line))


def resize(image: Bytes, scale: float) -> Image.Image:
    """The picture at another size."""
    by = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA
    return Image.fromarray(cv2.resize(image, None, fx=scale, fy=scale, interpolation=by))


def stack(parts: Sequence[Image.Image]) -> Image.Image:
    """One below the other."""
    sheet = Image.new("RGB", (max(p.width for p in parts), sum(p.height for p in parts)), PAPER)
    top = 0
    for part in parts:
        sheet.paste(part, (0, top))
        top += part.height
    return sheet


def side_by_side(parts: Sequence[Image.Image]) -> Image.Image:
    """One beside the other, on white."""
    sheet = Image.new("RGB", (sum(p.width + GAP for p in parts) + GAP, max(p.height for p in parts) + 2 * GAP), PAPER)
    left = GAP
    for part in parts:
        sheet.paste(part, (left, GAP))
        left += part.width + GAP
    return sheet


FIGURES: dict[str, Callable[[], Image.Image]] = {"words": words_figure, "colour": colour_figure, "super": super_figure}


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw one of the pictures."""
    parser = argparse.ArgumentParser(description="pictures of the documentation")
    parser.add_argument("figure", choices=FIGURES)
    parser.add_argument("out", type=Path)
    options = parser.parse_args(arguments)
    drawn = FIGURES[options.figure]()
    if options.figure != "colour":
        drawn = drawn.quantize(GREYS, dither=Image.Dither.NONE)
    drawn.save(options.out, optimize=True)


if __name__ == "__main__":
    main()
