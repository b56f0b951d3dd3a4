"""Messages are plain: errors, findings and texts of the page have no private dialect."""

import ast
import json
import re
from collections.abc import Iterator

import pytest

from oracles import ROOT
from restore.findings import CODES

STRINGS = json.loads((ROOT / "station" / "console" / "page" / "strings.json").read_text("utf-8"))
MODULES = [path for package in ("restore", "drivers", "station") for path in sorted((ROOT / package).rglob("*.py"))]
DIALECT = re.compile(
    r"\b(is|are|was|were) no (?!longer|more)|\b(is|are) none\b|\b(tells?|told)\b|\bshares? of\b|\bbeside\b"
    r"|\b(anew|afresh)\b|\bmend|\b(whoever|nobody|somebody)\b|\bshoot|\binvented\b|\btaken for\b"
    r"|\bfor certain\b|\bunforeseen\b",
    re.IGNORECASE,
)
RAISED = re.compile(r"(Error|Fault|Refused|Input|Surface|Sound|Page|Check|NotTrusted|Problem|Ending|Mismatch)$")


def texts_raised(tree: ast.Module) -> Iterator[str]:
    """The text of every message that a module raises: literals in the arguments of errors, placeholders left out."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and RAISED.search(ast.unparse(node.func)):
            for argument in [*node.args, *(one.value for one in node.keywords)]:
                yield "".join(
                    one.value
                    for one in ast.walk(argument)
                    if isinstance(one, ast.Constant) and isinstance(one.value, str)
                )


def test_errors_are_plain():
    trees = {str(path.relative_to(ROOT)): ast.parse(path.read_text("utf-8")) for path in MODULES}
    assert len(trees) > 600
    found = {name: [text for text in texts_raised(tree) if DIALECT.search(text)] for name, tree in trees.items()}
    assert {name: texts for name, texts in found.items() if texts} == {}


@pytest.mark.parametrize("code", CODES)
def test_findings_are_plain_sentences_of_at_most_forty_words(code):
    text = CODES[code].text
    assert not DIALECT.search(text)
    assert all(len(sentence.split()) <= 40 for sentence in text.split(". "))
    assert all(sentence[0].isupper() for sentence in text.split(". ")[1:])


def test_texts_of_the_page_are_plain():
    assert {key: text for key, (text, _) in STRINGS.items() if DIALECT.search(text)} == {}


def test_the_dialect_is_found():
    tree = ast.parse('raise BadInput(f"{path} is no scan", "mend it")')
    assert [bool(DIALECT.search(text)) for text in texts_raised(tree)] == [True, True]
    assert not DIALECT.search("the session is no longer in its folder")
