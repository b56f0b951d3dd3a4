"""A ratchet on words that are not plain English: their counts may fall, and never rise.

`python tests/test_language.py` prints the counts as they are, and `--write` keeps them in `language_counts.json`.
Documents are README, CONTRIBUTING, CHANGELOG and `docs/` without generated pages and code spans; code is every `.py`
file of the packages and the English texts of the web interface; tests are those of `tests`, `oracles` and `bench`. In
code and tests the words of a name count as those of a sentence.
"""

from __future__ import annotations

import json
import re
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES, TESTS = ("drivers", "restore", "station"), ("bench", "oracles", "tests")
GENERATED = ("cli.md", "keys.md")  # counted where they come from, in the code
# Of the report and the quality measures: the same.
GENERATED_TABLE = re.compile(r"^\| (?:key \| type|measure \| unit) \|.*\n(?:\|.*\n)*", re.MULTILINE)
COUNTS = ROOT / "tests" / "language_counts.json"  # of each pattern, in the documents, the code and the tests
MAX_WORDS = 20_500  # a newcomer finds what is needed; measurements have bench/results
MAX_PAGE_WORDS = 1200  # one reader and one task
MAX_MEAN_SENTENCE, MAX_SENTENCE = 20, 40  # words: readable once
NOT_PROSE = re.compile(r"```.*?```|^(?: {4,}|[|#!])[^\n]*$", re.DOTALL | re.MULTILINE)
CODE_SPAN = re.compile(r"```.*?```|`[^`\n]*`", re.DOTALL)
PARAGRAPH = re.compile(r"\n\s*\n|\n\s*(?=[-*] |\d+\. )")
SENTENCE = re.compile(r"(?<=[.!?:])\s+")
WORD = re.compile(r"[^\s|]*\w\S*")  # a path is one, a bar of a table is none


# Files whose matches are not counted, and why: names that others hold, and text that is drawn.
CONTRACT = {
    r"(?<!network )\bshares?\b(?! (a|the)\b)": {
        "restore/findings.py": "the key of a finding in stored reports",
        "restore/report.py": "it lists that key",
        "station/verdict/measures.py": "it reads that key",
        "drivers/simulated/scene/light.py": "a setting of a lamp in configurations",
        "drivers/simulated/imaging/illumination.py": "it reads that setting",
        "strings.json": "a placeholder in two languages",
        "station/session/leaves/index.py": "a folder of the XDG specification",
    },
    r"\b(mend(s|ed|ing)?|hurt)\b": {"station/session/fixity/repair.py": "a folder of repairs that were interrupted"},
}
DRAWN = "drivers/simulated/scene/artwork/text.py"  # the text of simulated pages: another text is another page


class Pattern(NamedTuple):
    """The regular expression of a phrase, what to write in its place, and why."""

    regex: str
    write: str
    reason: str


PATTERNS = (
    Pattern(r"(?<!\.)\b(tells?|telling|told)\b", "says, shows, reports, distinguishes", "programs do not talk"),
    Pattern(r"\b(is|are|was|were) no (?!longer|more)[a-z]", "is not a, is missing", "not the negation of English"),
    Pattern(r"\b(is|are) (?-i:none)\b", "is missing, is not a …", "a pronoun without a noun"),
    Pattern(r"\bbeside\b", "next to, in addition to, compared with", "three meanings in one word"),
    Pattern(
        r"(?<!network )\bshares?\b(?! (a|the)\b)",
        "fraction; share is for disks, and the verb",
        "not used for a ratio in the field",
    ),
    Pattern(r"\bso (many|much)\b", "n, the given number", "the number has a name"),
    Pattern(r"\b(whoever|nobody|somebody)\b", "users, no one, or the passive", "who acts is known"),
    Pattern(r"\b(anew|afresh)\b|\bcomes? along\b", "again; bundled", "archaic"),
    Pattern(r"\b(mend(s|ed|ing)?|hurt)\b", "repair; damaged", "not of files and data"),
    Pattern(r"\b(laid|lay|lays) (it |them )?(flat|out)\b", "flattened; packed", "terms of the field"),
    Pattern(r"\bway round\b|\b(askew|aslant)\b", "orientation; tilted", "terms of the field"),
    Pattern(r"\binvent(ed|s)?\b|\bdivided? .{0,12}out\b", "inpainted; removed", "terms of the field"),
    Pattern(r"\b(take[sn]?|took) for\b|\bfor certain\b", "mistaken for; reliably", "idioms"),
    Pattern(r"\bjudg(e|ed|es|ing|ment)\b", "check, assess", "a quality check has limits, not opinions"),
    Pattern(r"\b(sitting|testimony|public door|side doors?|rooms)\b", "session, API, packages", "private terms"),
    Pattern(r"\b(MOST|LEAST) [A-Z]", "MAX_, MIN_", "one convention for limits"),
    Pattern(r'(?m)^\s*"""\(', "a verb; the shape follows", "a docstring says what a function does"),
    Pattern(r'(?m)^\s*"""[^"\n]{89,}', "at most 88 characters in the first line", "it is a heading"),
)


@cache
def documents() -> dict[str, str]:
    """The text of each document by its path."""
    paths = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    texts = {path: path.read_text("utf-8") for path in paths if path.name not in GENERATED}
    return {str(path.relative_to(ROOT)): GENERATED_TABLE.sub("", text) for path, text in texts.items()}


@cache
def sources(packages: tuple[str, ...]) -> dict[str, str]:
    """The text of each module by its path, names as words; without this module, which has all the phrases."""
    paths = [path for package in packages for path in (ROOT / package).rglob("*.py") if path != Path(__file__)]
    return {str(path.relative_to(ROOT)): path.read_text("utf-8").replace("_", " ") for path in paths}


@cache
def code() -> dict[str, str]:
    """The text of each module of the packages, and the English texts of the web interface."""
    texts = json.loads((ROOT / "station" / "console" / "page" / "strings.json").read_text("utf-8"))
    english = {"strings.json": "\n".join(english for english, _ in texts.values())}
    return sources(PACKAGES) | english


def places(regex: str, texts: dict[str, str]) -> list[str]:
    """File and line of each match."""
    compiled = re.compile(regex, re.IGNORECASE if regex.islower() else 0)
    return [
        f"{name}:{text.count(chr(10), 0, match.start()) + 1} {match[0].strip()[:40]}"
        for name, text in texts.items()
        for match in compiled.finditer(text)
    ]


def counted(regex: str) -> dict[str, str]:
    """The modules in which a pattern is counted."""
    apart = {*CONTRACT.get(regex, {}), DRAWN}
    return {name: text for name, text in code().items() if name not in apart}


def prose() -> dict[str, str]:
    """The documents without code, each character of it a blank, so that lines keep their numbers."""
    blank = re.compile(r"[^\n]")
    return {name: CODE_SPAN.sub(lambda m: blank.sub(" ", m[0]), text) for name, text in documents().items()}


def sentences(text: str) -> list[str]:
    """Sentences of the paragraphs and lists of a document, without tables and code."""
    plain = NOT_PROSE.sub("\n", text)
    return [one for paragraph in PARAGRAPH.split(plain) for one in SENTENCE.split(" ".join(paragraph.split())) if one]


def counts() -> dict[str, list[int]]:
    """How often each pattern occurs in the documents, the code and the tests."""
    return {one.regex: [len(places(one.regex, texts)) for texts in searched(one.regex)] for one in PATTERNS}


def searched(regex: str) -> tuple[dict[str, str], ...]:
    """The texts in which a pattern is counted, in the order of the counts."""
    return prose(), counted(regex), sources(TESTS)


@pytest.mark.parametrize("pattern", PATTERNS, ids=lambda pattern: pattern.regex)
def test_a_pattern_does_not_spread(pattern: Pattern) -> None:
    allowed = json.loads(COUNTS.read_text("utf-8"))[pattern.regex]
    for texts, most in zip(searched(pattern.regex), allowed, strict=True):
        found = places(pattern.regex, texts)
        assert len(found) <= most, f"write {pattern.write} ({pattern.reason}): {found}"


def test_what_is_not_counted_is_there() -> None:
    assert CONTRACT.keys() <= {one.regex for one in PATTERNS}
    for regex, files in CONTRACT.items():
        assert all(places(regex, {name: code()[name]}) for name in files), regex


def test_the_documents_are_short() -> None:
    counts = {name: len(WORD.findall(text)) for name, text in documents().items() if name != "CHANGELOG.md"}
    assert {name: count for name, count in counts.items() if count > MAX_PAGE_WORDS} == {}
    assert sum(counts.values()) <= MAX_WORDS


@pytest.mark.parametrize("name", documents())
def test_sentences_are_short(name: str) -> None:
    lengths = {one: len(WORD.findall(one)) for one in sentences(documents()[name])}
    assert [one for one, length in lengths.items() if length > MAX_SENTENCE] == []
    assert sum(lengths.values()) <= MAX_MEAN_SENTENCE * max(len(lengths), 1)


def test_a_phrase_and_a_long_sentence_are_found() -> None:
    assert places(PATTERNS[0].regex, {"a.md": "one\nIt tells of it."}) == ["a.md:2 tells"]
    assert sentences("# Head\n\nOne, two. Three\nfour.\n\n- five\n- six\n\n| a | b |\n") == [
        "One, two.", "Three four.", "- five", "- six",
    ]  # fmt: skip


if __name__ == "__main__":
    printed = (
        json.dumps(counts(), indent=1, ensure_ascii=False)
        .replace("[\n  ", "[")
        .replace(",\n  ", ", ")
        .replace("\n ]", "]")
    )
    print(printed)
    if "--write" in sys.argv:
        COUNTS.write_text(printed + "\n", "utf-8")
