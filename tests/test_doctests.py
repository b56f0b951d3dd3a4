"""The public doors have examples: those in docstrings run and print what they show, others are in `examples/`."""

import doctest
import re
from pathlib import Path

import numpy as np
import pytest

import drivers
import restore

EXAMPLES = Path(__file__).parents[1] / "examples"
# These need several scans or photographs: `examples/` has them, and tests/test_examples.py runs it.
IN_EXAMPLES = {"fit_axis", "merge_views", "reconstruct_page"}
DOORS = {name: getattr(restore, name) for name in restore.__all__ if name not in IN_EXAMPLES}
DOORS |= {"open_scanner": drivers.open_scanner, "CaptureSettings": drivers.CaptureSettings}


# What a reader has after `from restore import *`, `from drivers import *` and these two imports.
NAMES = {"np": np, "Path": Path}
NAMES |= {name: getattr(door, name) for door in (restore, drivers) for name in door.__all__}


@pytest.mark.parametrize("name", DOORS)
def test_the_door_has_an_example_that_runs(name):
    finder, runner = doctest.DocTestFinder(recurse=False), doctest.DocTestRunner()
    tests = [test for test in finder.find(DOORS[name], name, globs=NAMES) if test.examples]
    assert tests, f"{name} has no example"
    for test in tests:
        assert runner.run(test).failed == 0


@pytest.mark.parametrize("name", sorted(IN_EXAMPLES))
def test_what_takes_more_than_a_docstring_has_an_example_that_it_names(name):
    (file,) = re.findall(r"`examples/(\w+\.py)`", getattr(restore, name).__doc__)
    assert f"{name}(" in (EXAMPLES / file).read_text("utf-8")
