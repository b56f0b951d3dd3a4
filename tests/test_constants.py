"""Every constant of the default flattening has its reason, in the source and in the table of the reference page."""

import pytest

from oracles.constants import ENGINE, ROOT, constants_of

PAGE = (ROOT / "docs" / "reference" / "constants.md").read_text("utf-8")


@pytest.mark.parametrize("module", ENGINE)
def test_every_constant_has_its_reason_and_its_line_in_the_table(module):
    for name, value, reason in constants_of(ROOT / module):
        assert reason, f"{name} in {module} has no reason"
        assert f"| `{name}` | {value} | {reason} |".replace("\\|", "|") in PAGE.replace("\\|", "|")


def test_the_table_has_as_many_lines_as_there_are_constants():
    count = sum(len(list(constants_of(ROOT / module))) for module in ENGINE)
    table = PAGE.partition("<!-- constants -->")[2].partition("<!-- end -->")[0]
    assert table.count("\n| ") - 1 == count  # the heading
    assert f"{count} constants" in table


def test_comments_beside_above_and_over_several_lines_are_found(tmp_path):
    module = tmp_path / "a.py"
    module.write_text("# above\nFIRST = 2\nSECOND, THIRD = 1.5, 3  # beside\n# and on\nNAME = 'x'\nother = 3\n")
    assert list(constants_of(module)) == [
        ("FIRST", "2", "above"),
        ("SECOND", "1.5", "beside and on"),
        ("THIRD", "3", "beside and on"),
    ]
