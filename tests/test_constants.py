"""The numbers of `restore`: their kinds, their reasons, and the page that lists those of a scan's default path."""

import re

import numpy as np
import pytest

from oracles.constants import BY_PLACE, Constant, Sources, called_in, constants_in, constants_of
from oracles.constants_page import PACKAGE, PAGE, cell, on_default_path
from restore.range_image.segmentation import segment
from restore.range_image.segmentation.outline import frame_of

TEXT = PAGE.read_text("utf-8")
COUNTS = {
    kind: (int(everywhere), int(there))
    for kind, everywhere, there in re.findall(r"\| (\w+) \| (\d+) \| (\d+) \|", TEXT)
}
MAX_TUNED = 494  # may fall, and not rise: a statistic of the noise or no mechanism first
ROW = re.compile(r"^\| ([\w/]+) \| `(\w+)` \| (.*?) \| (.*) \|$", re.MULTILINE)


def test_the_page_has_a_line_as_in_the_source_for_each_tuned_constant_that_a_scan_reads():
    sources = {(one.module, one.name): one for one in constants_in(PACKAGE)}
    rows = ROW.findall(TEXT)
    assert len(rows) == COUNTS["tuned"][1]
    for place, name, value, reason in rows:
        constant = sources[f"{PACKAGE}/{place}.py", name]
        assert (constant.kind, constant.value, cell(constant)) == ("tuned", value, reason)


def test_tuned_constants_are_no_more():
    assert sum(one.kind == "tuned" for one in constants_in(PACKAGE)) <= MAX_TUNED


def test_every_constant_that_is_said_not_to_be_tuned_exists():
    found = {(one.module, one.name) for one in constants_in(PACKAGE)}
    for kind, modules in BY_PLACE.items():
        for module, names in modules.items():
            for name in names.split():
                assert (f"{PACKAGE}/{module}.py", name) in found, f"{kind}: {module} {name}"


@pytest.mark.slow
def test_the_page_lists_what_restoring_a_scan_reads():
    read = [one for one in on_default_path() if one.kind == "tuned"]
    assert [(f"{PACKAGE}/{place}.py", name) for place, name, *_ in ROW.findall(TEXT)] == [one[:2] for one in read]


def test_comments_beside_above_and_over_several_lines_are_found(tmp_path):
    module = tmp_path / "a.py"
    module.write_text(
        "# above\nFIRST = 2\nSECOND, THIRD = 1.5, 3  # beside\n# and on\nNAME = 'x2'\nother = 3\nFOURTH = FIRST\n"
        "FIFTH: int = 5\nSIXTH = SEVENTH = 6\n"
    )
    assert [one[1:] for one in constants_of(module)] == [
        ("FIRST", "2", "above"),
        ("SECOND", "1.5", "beside and on"),
        ("THIRD", "3", "beside and on"),
        ("FIFTH", "5", ""),
        ("SIXTH", "6", ""),
        ("SEVENTH", "6", ""),
    ]


def test_what_is_in_no_table_is_tuned():
    kinds = [
        Constant(module, name, "1", "").kind
        for module, name in (
            ("restore/a.py", "LIMIT"),
            ("restore/a.py", "MAX_BYTES"),
            ("restore/formats/a.py", "MAGIC"),
            ("restore/formats/a.py", "MAX_HEADER"),
            ("restore/mesh/a.py", "TERMS"),
        )
    ]
    assert kinds == ["tuned", "budget", "standard", "budget", "exact"]


def test_a_run_reads_what_its_functions_and_their_kernels_name():
    outline = "restore/range_image/segmentation/outline.py"
    called = called_in(PACKAGE, lambda: frame_of(np.ones((4, 4), bool)))
    assert {module for module, _ in called} == {outline}
    sources = Sources(PACKAGE)
    labelled = sources.read_by(
        called_in(PACKAGE, lambda: segment._label_connected(np.ones((4, 4)), np.ones((4, 4), bool), 0.1))
    )
    assert ("restore/camera/rays.py", "MAX_GAP") in labelled  # through a kernel, out of another module
    assert ("restore/camera/rays.py", "MAX_SLOPE") not in labelled
    assert segment.__name__.replace(".", "/") + ".py" in {module for module, _ in labelled}
    assert ("restore/range_image/segmentation/segment.py", "_label") in sources.kernels_with(
        ("restore/camera/rays.py", "MAX_GAP")
    )
