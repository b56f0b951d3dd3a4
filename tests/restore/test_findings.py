"""Findings: one table of codes, and no sentence of a finding anywhere else."""

from __future__ import annotations

import ast
import json
import string

import pytest

from restore.findings import CODES, Finding


def placeholders(text):
    return {name for _, name, _, _ in string.Formatter().parse(text) if name}


@pytest.mark.parametrize("code", CODES)
def test_a_code_that_prints_a_fraction_says_of_what(code):
    entry = CODES[code]
    assert bool(entry.fraction_of) >= ("share" in placeholders(entry.text))


def test_a_finding_comes_back_from_its_json_values():
    one = Finding.of("hidden", 0.25)
    assert Finding.from_json(json.loads(json.dumps(one.as_json()))) == one
    assert one.text.startswith("25% of the page is hidden")


def test_an_unknown_code_or_a_missing_value_is_an_error_of_the_program():
    with pytest.raises(KeyError):
        Finding.of("no such code")
    with pytest.raises(KeyError):
        Finding.of("holes")


def test_findings_of_a_report():
    one = Finding.of("no_colour")
    assert Finding.all_in({"findings": [one.as_json()]}) == (one,)
    assert Finding.all_in({}) == ()


@pytest.mark.parametrize("value", [3, None, {"code": "hidden"}, {"code": "hidden", "severity": "grave", "text": "a"}])
def test_what_is_not_a_finding_is_refused(value):
    with pytest.raises(ValueError, match="not a finding"):
        Finding.from_json(value)


def made(tree):
    """The codes of all calls of Finding.of() in a module; None for one that is not a literal."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "Finding.of":
            first = node.args[0]
            yield first.value if isinstance(first, ast.Constant) else None


def test_every_code_is_made_somewhere_and_every_one_made_is_in_the_table(repository):
    codes = set()
    for package in ("restore", "station", "drivers"):
        for path in (repository / package).rglob("*.py"):
            codes |= set(made(ast.parse(path.read_text("utf-8"))))
    # Three places make a finding of a name that they look up in a table of their own.
    assert codes - {None} <= set(CODES)
    assert set(CODES) - codes <= {"lost_border", "turned_border", "light_kept", "white_kept"}


def test_sentences_stand_in_the_table_alone(repository):
    """No list of findings or warnings takes a string: what is reported has a code."""
    takers = ("findings", "warnings")
    for package in ("restore", "station", "drivers"):
        for path in (repository / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.keyword) and node.arg in takers:
                    assert not holds_text(node.value), f"{path}:{node.value.lineno}"
                if isinstance(node, ast.Dict):
                    for key, value in zip(node.keys, node.values, strict=True):
                        if isinstance(key, ast.Constant) and key.value in takers:
                            assert not holds_text(value), f"{path}:{value.lineno}"


def holds_text(node):
    """Whether an expression is, or lists, a string or an f-string."""
    parts = node.elts if isinstance(node, ast.List | ast.Tuple) else [node]
    return any(
        isinstance(part, ast.JoinedStr) or (isinstance(part, ast.Constant) and isinstance(part.value, str))
        for part in parts
    )
