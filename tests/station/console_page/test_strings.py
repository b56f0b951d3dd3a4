"""The table of strings has every text in both languages, and no other."""

from __future__ import annotations

import json
import re

from station.archive.formats import Format
from station.console.vendored import PAGE
from station.verdict.table import MEASURES

TEXT = (PAGE / "strings.json").read_text("utf-8")
TABLE = json.loads(TEXT)
SOURCES = {path.name: path.read_text("utf-8") for path in (PAGE / "js").rglob("*.js")}
ALL = "\n".join(SOURCES.values())
LITERALS = set(re.findall(r'"([a-z][\w]*(?:\.[\w]+)*)"', ALL))
# The beginnings of keys that are put together: t(`level.${…}`).
BEGINNINGS = tuple(beginning for beginning in re.findall(r"`([a-z]+\.)\$\{", ALL))
USED = re.compile(r'\bt\((?:[^()"`]*\? )?"([^"]+)"(?: : "([^"]+)")?')


def is_used(key: str) -> bool:
    return key in LITERALS or key.removesuffix(".text") in LITERALS or key.startswith(BEGINNINGS)


def places(text: str) -> set[str]:
    return set(re.findall(r"\{\w+\}", text))


def test_no_key_is_there_twice():
    keys = [key for key, _ in json.loads(TEXT, object_pairs_hook=list)]
    assert sorted(keys) == sorted(TABLE)


def test_every_text_has_both_languages_with_the_same_places():
    assert [key for key, texts in TABLE.items() if len(texts) != 2 or not all(text.strip() for text in texts)] == []
    assert [key for key, (english, german) in TABLE.items() if places(english) != places(german)] == []


def test_every_key_that_the_page_uses_is_in_the_table():
    used = {key for match in USED.finditer(ALL) for key in match.groups() if key}
    assert len(used) > 100  # the expression finds them
    assert used - TABLE.keys() == set()


def test_every_quality_measure_has_its_unit_its_name_and_its_hint():
    assert {f"{kind}.{name}" for kind in ("measure", "hint") for name in MEASURES} - TABLE.keys() == set()


def test_every_format_of_an_export_is_offered_with_its_texts():
    offered = re.search(r"const FORMATS = (\[.*\]);", SOURCES["export.js"])
    assert offered and {name for name, _ in json.loads(offered[1])} == set(Format)
    assert {f"format.{name}{end}" for name in Format for end in ("", ".text")} - TABLE.keys() == set()


def test_every_key_of_the_table_is_used():
    assert [key for key in TABLE if not is_used(key)] == []


def test_no_text_is_written_into_the_page_itself():
    """Words beside the table would stay in one language."""
    written = re.findall(r'text: "([^"]*[A-Za-z]{3}[^"]*)"', ALL)
    assert written == ["Planish"]
