"""The examples in the docstrings of the public doors run and print what they show."""

import doctest
from pathlib import Path

import numpy as np
import pytest

import drivers
import restore

DOORS = {
    "restore": restore.restore,
    "flatten": restore.flatten,
    "load_scan": restore.load_scan,
    "edges_of": restore.edges_of,
    "Settings": restore.Settings,
    "RangeScan": restore.RangeScan,
    "open_scanner": drivers.open_scanner,
    "CaptureSettings": drivers.CaptureSettings,
}


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
