"""What `python -m bench` runs is there: a bench that fails on its first line measures nothing."""

import shutil
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import bench

MODULES = sorted(path.stem for path in Path(bench.__file__).parent.glob("*.py") if not path.stem.startswith("__"))
READ_ACROSS = [396408, 0]  # seed of a page that Tesseract reads across by its noise: found among a dozen
IN_ORDER = 0.95  # of the words; read across, a tenth is
# They come with the extra `bench` alone.
OPTIONAL = ("igl", "matplotlib", "skimage")


@pytest.mark.parametrize("name", MODULES)
def test_every_module_is_read_without_a_fault(name):
    try:
        import_module(f"bench.{name}")
    except ImportError as missing:
        if missing.name not in OPTIONAL:
            raise
        pytest.skip(f"{missing.name} is not installed")


def test_pages_are_drawn_by_their_seed():
    from bench.words import tasks

    assert tasks(7) == tasks(7)
    assert len(tasks(7)) == 52
    assert not {task.sheet for task in tasks(7)} & {task.sheet for task in tasks(8)}


def test_a_black_body_is_neutral_at_the_balance_of_the_camera_and_reddish_below():
    from bench.light_white import BALANCED_K, planckian

    np.testing.assert_allclose(planckian(BALANCED_K), 1.0)
    red, _, blue = planckian(2856.0)
    assert red > 1.5  # CIE illuminant A, 1.8 and 0.4 at these wavelengths
    assert blue < 0.5


def test_words_that_differ_in_their_punctuation_alone_are_counted():
    from bench.words_resolved import marks_missed

    assert marks_missed("The sheet lies on the leaf. All is even.", "The shect lies on the leaf, All is even,") == 2
    assert marks_missed("One leaf.", "One leaf.") == 0
    assert marks_missed("The leaf. Two", "Thc leaf. Too") == 0  # letters are no marks


@pytest.mark.skipif(shutil.which("tesseract") is None, reason="needs the system package tesseract-ocr")
def test_a_page_of_two_columns_is_read_column_by_column():
    from bench.reading import CAMERA_DPI, PAGE_DPI, columns, painted
    from station.words.ocr_precision import count_matching_words
    from station.words.words import recognise

    rng = np.random.default_rng(READ_ACROSS)
    image, printed = columns(rng)
    read = recognise(painted(image, CAMERA_DPI, rng), PAGE_DPI, name="page").text
    assert count_matching_words(printed, read).precision > IN_ORDER
    assert "|" not in read


def test_the_stages_of_a_profile_take_all_of_its_time():
    from bench import profile

    ours, theirs = str(profile.ROOT / "restore" / "a.py"), "/elsewhere/b.py"
    seconds = {
        (ours, "prepare"): 3.0,
        (ours, "fit_facets"): 2.0,
        (ours, "straighten"): 1.0,
        (theirs, "paint_page"): 4.0,
    }
    table = {(file, 1, name): (1, 1, one, one, {}) for (file, name), one in seconds.items()}
    found = profile.stages(SimpleNamespace(stats=table, total_tt=10.0))
    assert found["facets"] == pytest.approx(0.2)
    assert found["else of preparing"] == pytest.approx(0.1)
    assert (found["straight sides"], found["painting"]) == (pytest.approx(0.1), 0.0)
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["all else"] == pytest.approx(0.6)
