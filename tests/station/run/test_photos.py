"""`planish photos`: from JPEG files to a page true to scale, and what it refuses."""

from __future__ import annotations

import json
import subprocess
import sys

import cv2
import numpy as np
import pytest
import tifffile
from PIL import Image

from drivers.simulated import Text, Wave
from oracles.markers import rigid_residual
from oracles.simulation.photographs import Shots, encode_jpeg, photograph_page
from restore.photogrammetry import SCALE_CARD
from station.cli import main
from station.errors import UsageError
from station.run.photos import Scale

PAGE_MM = (160.0, 110.0)
SHOTS = Shots(size=(1200, 900))
CARD_DPI = 177.8  # seven pixels to a millimetre
VIEWS = 5
QUICK = ("--points", "300", "--dpi", "50")
# Pixels are 0.25 mm on the page here, a third as fine as a phone's. A tenth of them over the print; margins are blank.
LAYOUT_MM = 0.15
SCALE_ERROR = 0.002
ENDS_S = 300.0  # on a machine with many at work
# The command, interrupted soon after a stage has begun.
INTERRUPTED = """
import os, signal, sys, threading
from station.cli import main
from station.run import photos

original, stage = photos.reconstruct_page, sys.argv[1]

def begun(name, done):
    if (name, done) == (stage, 0.0):
        threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT)).start()

photos.reconstruct_page = lambda given, **options: original(given, **{**options, "progress": begun})
sys.exit(main(sys.argv[2:]))
"""
SIZE_MM = 0.4  # two sides, each seen to less than a pixel


@pytest.fixture(scope="module")
def photographs(tmp_path_factory):
    sheet = Wave(slope_deg=22.0, wavelength_mm=110.0)
    card = SCALE_CARD.picture(CARD_DPI)
    taken = photograph_page(
        sheet, Text(sizes_pt=(10.0,), title_pt=16.0, margin_mm=10.0, columns=2), views=VIEWS, seed=3, card=card,
        card_dpi=CARD_DPI, shots=SHOTS, page_mm=PAGE_MM,
    )  # fmt: skip
    return taken, taken.save(tmp_path_factory.mktemp("photographs"))


def layout(folder, report, taken) -> tuple[np.ndarray, float]:
    """Errors (n, 2) mm of the page's pixels over the print after a rigid fit, and its scale."""
    page_map = tifffile.imread(folder / "IMG_0001-map.tif")
    rows, cols = np.nonzero(np.isfinite(page_map[..., 0]))
    rows, cols = rows[::53], cols[::53]
    source = page_map[rows, cols, 2].astype(int)
    flat = np.full((len(rows), 2), np.nan)
    for number in range(1, VIEWS + 1):
        here = source == number
        if here.any():
            flat[here], _ = taken.truth_at(number - 1, page_map[rows, cols, :2][here].astype(float))
    printed = ((flat > 12) & (flat < np.array(PAGE_MM) - 12)).all(axis=1)
    places = np.stack([cols, -rows], axis=1)[printed] * 25.4 / report["dpi"]
    rest, scale = rigid_residual(places, flat[printed])
    return rest, scale


@pytest.mark.slow
def test_a_page_is_restored_true_to_scale(photographs, tmp_path, capsys):
    pytest.importorskip("pycolmap")
    taken, paths = photographs
    assert main(["photos", *map(str, paths), "-o", str(tmp_path), "--map", "--json", *QUICK]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["photogrammetry"]["scale_source"]["from"] == "card"
    assert report["photogrammetry"]["rejected"] == {}
    assert [photo["accepted"] for photo in report["photos"]] == [True] * VIEWS
    np.testing.assert_allclose(report["page_mm"], PAGE_MM, atol=SIZE_MM)
    rest, scale = layout(tmp_path, report, taken)
    assert np.sqrt((rest**2).sum(axis=1).mean()) < LAYOUT_MM
    assert abs(scale - 1) < SCALE_ERROR
    with Image.open(tmp_path / "IMG_0001.png") as page:
        assert page.info["dpi"][0] == pytest.approx(report["dpi"], abs=0.0254)  # PNG has whole pixels to a metre


@pytest.fixture
def noise(tmp_path):
    """Three small pictures of nothing."""
    rng = np.random.default_rng(1)
    paths = [tmp_path / f"{name}.jpg" for name in ("one", "two", "three")]
    for path in paths:
        path.write_bytes(encode_jpeg(rng.integers(0, 256, (120, 160, 3), np.uint8)))
    return paths


def test_two_photographs_are_refused(noise, tmp_path, capsys):
    assert main(["photos", *map(str, noise[:2]), "-o", str(tmp_path / "out")]) == 5
    assert "2 photographs are too few" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_photographs_of_nothing_are_refused(noise, tmp_path, capsys):
    pytest.importorskip("pycolmap")
    assert main(["photos", *map(str, noise), "-o", str(tmp_path / "out")]) == 5
    reported = capsys.readouterr().err
    assert "0 of 3 photographs join" in reported
    assert all(
        f"{name}.jpg: it shows nothing that another photograph shows" in reported for name in ("one", "two", "three")
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_photographs_from_one_place_are_refused(photographs, tmp_path, capsys):
    pytest.importorskip("pycolmap")
    rng = np.random.default_rng(2)
    image = photographs[0].images[0]
    paths = [tmp_path / f"{number}.jpg" for number in range(3)]
    for path in paths:
        noisy = np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8)
        path.write_bytes(encode_jpeg(noisy))
    assert main(["photos", *map(str, paths), "-o", str(tmp_path / "out")]) == 5
    assert "degrees" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("stage", ["matching", pytest.param("cameras", marks=pytest.mark.slow), "surface"])
def test_ctrl_c_ends_it_with_nothing_written(photographs, tmp_path, stage):
    """In a process of its own: an interrupt while a kernel is loaded may leave Numba's lock taken."""
    pytest.importorskip("pycolmap")
    words = [sys.executable, "-c", INTERRUPTED, stage, "photos", *map(str, photographs[1]), "-o", str(tmp_path / "out")]
    ended = subprocess.run(words, capture_output=True, text=True, check=False, timeout=ENDS_S)
    assert ended.returncode == 130, ended.stderr
    assert "Ctrl-C" in ended.stderr
    assert not (tmp_path / "out").exists()


def without_card(image, camera, scene):
    """A photograph with a grey sheet over the card."""
    lying = scene.lying
    angle = np.radians(lying.turn_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    table = scene.vertices[scene.faces[~scene.on_page][0], 2].mean()
    corners = (SCALE_CARD.outline * 1.02) @ turn.T + lying.middle_mm
    pixels = camera.project(np.column_stack([corners, np.full(4, table)]))
    return cv2.fillPoly(image.copy(), [np.rint(pixels).astype(np.int32)], (90, 80, 70))


@pytest.mark.slow
def test_a_card_in_two_photographs_gives_no_scale_and_says_so(photographs, tmp_path, capsys):
    pytest.importorskip("pycolmap")
    taken, paths = photographs
    for number in (1, 2, 4):
        hidden = without_card(taken.images[number], taken.cameras[number], taken.scene)
        (tmp_path / paths[number].name).write_bytes(encode_jpeg(hidden))
    given = [tmp_path / path.name if number in (1, 2, 4) else path for number, path in enumerate(paths)]
    assert main(["photos", *map(str, given), "-o", str(tmp_path / "out"), "--json", *QUICK]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["photogrammetry"]["scale_source"] == {"from": "none"}
    assert {"card_in_few", "no_scale"} <= {one["code"] for one in report["findings"]}


@pytest.mark.slow
def test_the_scale_comes_from_the_size_of_the_page(photographs, tmp_path, capsys):
    pytest.importorskip("pycolmap")
    _, paths = photographs
    size = f"{PAGE_MM[1]:g}x{PAGE_MM[0]:g}"  # either way round
    assert main(["photos", *map(str, paths), "-o", str(tmp_path / "out"), "--scale", size, "--json", *QUICK]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["photogrammetry"]["scale_source"]["from"] == "page"
    assert sorted(report["page_mm"]) == pytest.approx(sorted(PAGE_MM), abs=SIZE_MM)
    assert not any("scale" in one["text"] for one in report["findings"])


@pytest.mark.slow
def test_a_page_of_another_shape_is_refused(photographs, tmp_path, capsys):
    pytest.importorskip("pycolmap")
    assert main(["photos", *map(str, photographs[1]), "-o", str(tmp_path / "out"), "--scale", "210x297"]) == 3
    assert "to 1" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_page_is_restored_from_a_video(photographs, tmp_path, capsys):
    pytest.importorskip("pycolmap")
    video = cv2.VideoWriter(str(tmp_path / "page.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 10, SHOTS.size)
    for image in photographs[0].images:
        frame = np.ascontiguousarray(image[..., ::-1])
        for blur in (4.0, 0.0, 4.0):  # the camera comes to rest, and goes on
            video.write(cv2.GaussianBlur(frame, (0, 0), blur) if blur else frame)
    video.release()
    assert main(["photos", str(tmp_path / "page.avi"), "-o", str(tmp_path / "out"), "--json", *QUICK]) == 0
    report = json.loads(capsys.readouterr().out)
    numbers = [int(name.split()[-1]) for name in report["photogrammetry"]["photographs_used"]]
    assert numbers == [3 * k + 2 for k in range(VIEWS)]  # the sharp ones
    np.testing.assert_allclose(report["page_mm"], PAGE_MM, atol=SIZE_MM)


def test_a_video_is_given_by_itself(noise, tmp_path, capsys):
    assert main(["photos", str(noise[0]), "film.mp4", "-o", str(tmp_path / "out")]) == 3
    assert "by itself" in capsys.readouterr().err


def test_another_size_is_refused_by_name(noise, tmp_path, capsys):
    with Image.open(noise[2]) as picture:
        cropped = picture.crop((0, 0, 100, 100))
    cropped.save(tmp_path / "cropped.jpg")
    assert main(["photos", *map(str, noise[:2]), str(tmp_path / "cropped.jpg"), "-o", str(tmp_path / "out")]) == 3
    reported = capsys.readouterr().err
    assert "cropped.jpg 100 × 100" in reported
    assert "one camera" in reported


def test_results_are_not_overwritten_unasked(noise, tmp_path, capsys):
    (tmp_path / "one.png").write_text("mine")
    assert main(["photos", *map(str, noise), "-o", str(tmp_path)]) == 2
    assert "--force" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("card", Scale()),
        ("none", Scale(card=False)),
        ("210x297", Scale(card=False, page_mm=(210.0, 297.0))),
        ("148.5 × 210", Scale(card=False, page_mm=(148.5, 210.0))),
    ],
)
def test_scales_are_read(text, expected):
    assert Scale.parse(text) == expected


@pytest.mark.parametrize("text", ["", "A4", "210", "0x5", "-3x4", "210x"])
def test_other_scales_are_refused(text, tmp_path, capsys):
    with pytest.raises(UsageError, match="--scale"):
        Scale.parse(text)
    assert main(["photos", "a.jpg", "-o", str(tmp_path), "--scale", text]) == 2
    capsys.readouterr()
