"""A short volume worked through by the keyboard alone, from an empty folder to four formats, each valid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from oracles.console.browser import window
from oracles.console.keyboard import deliver, work
from oracles.console.process import console_of

OPENINGS = ("4", "14")  # text, which needs nothing; flat-lying, which asks for its layout
MOVED = 2  # the page whose spine is moved


@pytest.mark.slow
def test_two_keys_for_what_needs_nothing_and_eight_for_a_spine(browser: Any, tmp_path: Path) -> None:
    with console_of(tmp_path, "book") as console, window(browser, console.start(*OPENINGS)) as page:
        plain, spine = work(page, "Book", len(OPENINGS), {MOVED})
        assert (plain.what, plain.leaves, spine.what, spine.leaves) == ("plain", 2, "spine", 2)
        assert plain.keys == 2
        assert spine.keys <= 8
        assert deliver(page) > 0
