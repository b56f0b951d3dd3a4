"""A chart whose colours are known, seen by cameras whose curves and matrices are known."""

from __future__ import annotations

import io
import json

import cv2
import numpy as np
import pytest
from PIL import Image, ImageCms

from drivers.simulated import Chart, Flat, shoot
from drivers.simulated.scene.artwork.chart import PATCHES
from restore.errors import BadInput
from restore.formats import save_scan
from station.cli import main
from station.colour.chart import Chart as SeenChart
from station.colour.chart import find_chart
from station.colour.figures import CRITERIA, quality_figures
from station.colour.fit import fit_colours, linear_light, tone_curve
from station.colour.lab import difference, lab_of_linear
from station.images.icc import encode_profile, srgb_profile
from station.images.png import encode_png

PAGE_MM = (140.0, 100.0)
CYAN = 17  # outside sRGB: its print is the nearest colour that sRGB has
EXACT = 0.5  # ΔE2000 on average: codes are whole numbers, and OpenCV's fit ends before the optimum
ROUNDED = 0.8  # ΔE2000 at most, in the dark, where half a code is most
SAME_DATA = 0.02  # ΔE2000 between OpenCV's copy of the chart and ours: adaptation matrices of four digits

CROSSTALK = np.array([[0.80, 0.15, 0.05], [0.08, 0.82, 0.10], [0.03, 0.17, 0.80]])


@pytest.fixture(scope="module")
def printed():
    image = Chart().print_on(PAGE_MM).image
    return cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)


def camera(
    image: np.ndarray, *, exponent: float = 2.4, matrix: np.ndarray = CROSSTALK, gain: float = 0.9
) -> np.ndarray:
    """What a camera of that curve and matrix makes of an sRGB picture."""
    light = gain * linear_light(image.astype(float), 2.4) @ matrix.T
    table = linear_light(np.arange(256.0), exponent)
    return np.interp(light, table, np.arange(256.0)).round().astype(np.uint8)


def patches(printed_chart: np.ndarray) -> np.ndarray:
    return find_chart(printed_chart).codes


def test_the_chart_is_found_whole_and_in_order(printed):
    wanted = np.array(list(PATCHES.values()))
    seen = lab_of_linear(linear_light(patches(printed), 2.4))
    off = difference(seen, wanted)
    assert np.delete(off, CYAN).max() < ROUNDED
    assert find_chart(printed).noise.max() < 1.0


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_a_chart_that_lies_otherwise_is_read_alike(printed, turns):
    np.testing.assert_allclose(patches(np.rot90(printed, turns)), patches(printed), atol=1.0)


def test_the_reference_is_the_chart_as_published(printed):
    fit = fit_colours(find_chart(printed))
    assert difference(fit.reference, np.array(list(PATCHES.values()))).max() < SAME_DATA


@pytest.mark.parametrize("exponent", [1.8, 2.4, 2.9])
def test_the_fit_finds_the_camera(printed, exponent):
    fit = fit_colours(find_chart(camera(printed, exponent=exponent)))
    assert difference(fit.uncorrected, fit.reference).mean() > 3
    assert np.delete(difference(fit.corrected, fit.reference), CYAN).mean() < EXACT
    assert fit.exponent == pytest.approx(exponent, abs=0.1)


def test_the_profile_makes_others_see_the_true_colours(printed):
    """LittleCMS turns the camera's picture into sRGB by the profile."""
    seen = camera(printed)
    profile = encode_profile(fit_colours(find_chart(seen)).profile("camera"))
    turn = ImageCms.buildTransform(
        ImageCms.ImageCmsProfile(io.BytesIO(profile)),
        ImageCms.ImageCmsProfile(io.BytesIO(srgb_profile())),
        "RGB",
        "RGB",
    )
    turned = np.asarray(ImageCms.applyTransform(Image.fromarray(seen), turn))
    wanted, before, after = (lab_of_linear(linear_light(patches(p), 2.4)) for p in (printed, seen, turned))
    assert difference(before, wanted).mean() > 4
    assert np.delete(difference(after, wanted), CYAN).mean() < 2 * EXACT  # once more through whole numbers


def test_the_curve_is_one_piece():
    for exponent in (1.4, 2.4, 3.4):
        _, _, _, _, knee = tone_curve(exponent)
        around = np.array([knee - 1e-9, knee + 1e-9]) * 255
        assert np.ptp(linear_light(around, exponent)) < 1e-6
        assert linear_light(np.array([0.0, 255.0]), exponent) == pytest.approx([0, 1])


SPREAD = 0.02  # of the light of a patch: print and flare, which no fit explains
FALL_OFF = 0.04  # by which the fall-off that is found may be off: two and a half standard deviations of such patches
OPTIMISM = 0.12  # by which the error on patches left out may lie below the truth, the mean over the cameras


def odd_camera(codes, seed, *, fall_off=0.0, falls=0.0):
    """Codes (24, 3) of patches by a camera that is no matrix, under a light that falls off towards an angle."""
    rng = np.random.default_rng(seed)
    y, x = np.meshgrid(np.linspace(-1, 1, 4), np.linspace(-1, 1, 6), indexing="ij")
    way = (np.cos(falls) * x + np.sin(falls) * y).ravel()
    gain = 0.9 * (1 - fall_off * (way - way.min()) / np.ptp(way))
    light = gain[: len(codes), None] * (linear_light(codes, 2.4) @ CROSSTALK.T)
    light = light ** (1 + 0.05 * rng.normal(size=3)) * (1 + SPREAD * rng.normal(size=light.shape))
    return np.interp(light, linear_light(np.arange(256.0), 2.2), np.arange(256.0)).round()


@pytest.mark.slow
@pytest.mark.parametrize(("fall_off", "falls"), [(0.0, 0.0), (0.15, 1.0), (0.55, 2.5)])
def test_light_that_falls_off_over_the_chart_is_seen_and_taken_out(printed, fall_off, falls):
    chart = find_chart(printed)
    fit = fit_colours(SeenChart(odd_camera(chart.codes, 31, fall_off=fall_off, falls=falls), chart.noise))
    assert fit.fall_off == pytest.approx(fall_off, abs=FALL_OFF)
    even = fit_colours(SeenChart(odd_camera(chart.codes, 31), chart.noise))
    errors = [difference(one.left_out, one.reference).mean() for one in (fit, even)]
    assert errors[0] < 1.25 * errors[1] + EXACT
    levels = {figure["FADGI"] for figure in figures_of(fit).values() if "FADGI" in figure}
    assert (levels == {None}) == (fall_off > 0)


@pytest.mark.slow
def test_the_error_is_that_of_colours_that_the_fit_has_not_seen(printed):
    """The truth is the error on the same colours by the same camera, their print and flare drawn afresh."""
    chart = find_chart(printed)
    ratios = []
    for seed in range(40, 43):
        fit = fit_colours(SeenChart(odd_camera(chart.codes, seed), chart.noise))
        inside, outside = (difference(lab, fit.reference).mean() for lab in (fit.corrected, fit.left_out))
        assert outside > inside
        mixed = chart.codes[:, [1, 2, 0]]  # other colours, of which the chart has few
        wanted = lab_of_linear(linear_light(mixed, 2.4))
        seen = lab_of_linear(linear_light(odd_camera(mixed, seed), fit.exponent) @ fit.matrix.T)
        ratios.append([inside / difference(seen, wanted).mean(), outside / difference(seen, wanted).mean()])
    below, left_out = np.mean(ratios, axis=0)
    assert left_out > 1 - OPTIMISM
    assert below < left_out


def test_noise_and_wrong_colours_are_measured(printed):
    rng = np.random.default_rng(4)
    noisy = np.clip(printed + rng.normal(0, 6, printed.shape), 0, 255).astype(np.uint8)
    clean, loud = (figures_of(fit_colours(find_chart(picture))) for picture in (printed, noisy))
    assert loud["noise, worst grey"]["value"] > 2.0 > 0.5 > clean["noise, worst grey"]["value"]
    assert clean["noise, worst grey"]["FADGI"] == "4 stars"
    assert loud["noise, worst grey"]["FADGI"] in ("2 stars", "1 star", None)


def figures_of(fit, **known):
    return {figure["figure"]: figure for figure in quality_figures(fit, **known)}


def test_what_is_not_measured_is_not_claimed(printed):
    fit = fit_colours(find_chart(printed))
    assert "sampling" not in figures_of(fit)
    assert figures_of(fit, ppi=53.0)["sampling"]["FADGI"] is None
    assert figures_of(fit, ppi=300.0)["sampling"]["FADGI"] == "3 stars"


def test_levels_are_met_at_their_limits_and_strictest_first():
    for criterion in CRITERIA:
        for limits in (criterion.fadgi, criterion.iso):
            worse = -1e-6 if criterion.least else 1e-6
            values = list(limits.values())
            assert values == sorted(values, reverse=criterion.least)
            for level, limit in limits.items():
                assert limits[criterion.met(limit, limits)] == limits[level]
                assert criterion.met(limit + worse, limits) != level
    assert criterion.met(0.0, criterion.fadgi) is None


@pytest.mark.parametrize("picture", ["white", "noise", "black"])
def test_a_picture_without_a_chart_is_refused(picture):
    rng = np.random.default_rng(5)
    pictures = {
        "white": np.full((300, 400, 3), 240),
        "black": np.zeros((300, 400, 3)),
        "noise": rng.integers(0, 255, (300, 400, 3)),
    }
    with pytest.raises(BadInput, match="no colour chart"):
        find_chart(pictures[picture].astype(np.uint8))


def test_an_overexposed_chart_is_refused(printed):
    with pytest.raises(BadInput, match="overexposed"):
        find_chart(np.clip(printed * 1.3, 0, 255).astype(np.uint8))


def test_noise_of_a_made_up_chart_is_its_standard_deviation_in_lightness(printed):
    codes = patches(printed)
    fit = fit_colours(SeenChart(codes, np.ones_like(codes)))
    step = lab_of_linear(linear_light(codes + 1, 2.4))[:, 0] - lab_of_linear(linear_light(codes, 2.4))[:, 0]
    np.testing.assert_allclose(fit.noise, step, rtol=0.1)


@pytest.mark.slow
def test_the_command_writes_profile_and_figures(printed, tmp_path, capsys):
    (tmp_path / "chart.png").write_bytes(encode_png(camera(printed)))
    (tmp_path / "chart.json").write_text('{"sampling_ppi": 53.4}')
    ask = ["colour", str(tmp_path / "chart.png"), "-o", str(tmp_path / "out" / "camera")]
    assert main(ask) == 0
    out = capsys.readouterr().out
    assert "no level as a whole is claimed" in out
    assert "sampling" in out
    report = json.loads((tmp_path / "out" / "camera.json").read_text())
    assert report["mean_difference"]["by the profile"] < report["mean_difference"]["as sRGB"]
    assert report["mean_difference"]["by the profile"] < report["mean_difference"]["on held-out patches"]
    assert (report["light_fall_off"], report["findings"]) == (0.0, [])
    assert (tmp_path / "out" / "camera.icc").read_bytes()[36:40] == b"acsp"
    assert main(ask) == 2
    assert main([*ask, "--force"]) == 0


def test_the_command_warns_of_uneven_light(printed, tmp_path, capsys):
    dimmer = 1 - 0.5 * np.linspace(0, 1, printed.shape[1])[None, :, None]
    light = linear_light(printed.astype(float), 2.4) * 0.9 * dimmer
    codes = np.interp(light, linear_light(np.arange(256.0), 2.4), np.arange(256.0)).round().astype(np.uint8)
    (tmp_path / "chart.png").write_bytes(encode_png(codes))
    assert main(["colour", str(tmp_path / "chart.png"), "-o", str(tmp_path / "camera")]) == 0
    out = capsys.readouterr().out
    assert "light falls off by" in out
    assert "star" not in out
    assert "level A" not in out


@pytest.mark.slow
def test_the_command_reads_scans(tmp_path, capsys):
    scan, _ = shoot(Flat(), Chart())
    save_scan(scan, tmp_path / "chart.scan")
    assert main(["colour", str(tmp_path / "chart.scan"), "-o", str(tmp_path / "camera.icc")]) == 0
    report = json.loads((tmp_path / "camera.json").read_text())
    assert report["mean_difference"]["by the profile"] < 1.0
    assert "sampling" not in report["not_measured"]
    assert {figure["figure"]: figure for figure in report["figures"]}["sampling"]["FADGI"] is None
    capsys.readouterr()


@pytest.mark.parametrize("seed", range(3))
def test_patches_of_no_chart_are_refused(seed):
    codes = np.random.default_rng(seed).uniform(0, 250, (24, 3))
    with pytest.raises(BadInput, match="no colour chart"):
        fit_colours(SeenChart(codes, np.ones((24, 3))))


def test_a_bad_camera_still_sees_a_chart(printed):
    """Strong crosstalk, a harsh curve and noise of 5 codes, which puts patches at the ends of the scale."""
    crosstalk = np.array([[0.6, 0.3, 0.1], [0.2, 0.6, 0.2], [0.1, 0.3, 0.6]])
    chart = find_chart(camera(printed, exponent=3.2, matrix=crosstalk, gain=0.6))
    noise = np.random.default_rng(2).normal(0, 5, chart.codes.shape)
    fit_colours(SeenChart(np.clip(1.2 * chart.codes + noise, 0, 254), chart.noise))
