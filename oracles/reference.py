"""The page with the reference of keys and of the public API, out of the code."""

from __future__ import annotations

import inspect

import restore
from oracles import ROOT
from oracles.keys import GENERIC, KEYS
from station.verdict.table import MEASURES

QUALITY = ROOT / "docs" / "reference" / "quality-measures.md"
PAGE = ROOT / "docs" / "reference" / "keys.md"
HEAD = """# Keys and names

Written by `python -m bench.reference --write-docs`. A name has the same meaning in reports, presets, events and
configurations. Types are those of JSON: a flag is true or false, a table an object, a list is in brackets.
[Quality measures](quality-measures.md) have their own page; in `thresholds` each has its amber and its red limit.

## Keys

| key | type | unit | meaning | module |
|---|---|---|---|---|
"""


def reference() -> str:
    """The page: a line for each key, for each generic word, and for each name of the public API."""
    rows = [
        f"| `{name}` | {key.type.replace('|', ' or ')} | {key.unit} | {key.meaning} | `{key.made}` |"
        for name, key in sorted(KEYS.items())
        if name not in MEASURES
    ]
    words = [f"| `{name}` | {meaning} |" for name, meaning in sorted(GENERIC.items())]
    names = [f"| `{name}` | {_first_line(name)} |" for name in sorted(restore.__all__)]
    sections = (
        ["\n## Words that need their table\n", "| key | meaning |", "|---|---|", *words],
        ["\n## Python: `restore`\n", "| name | what it is |", "|---|---|", *names],
    )
    return HEAD + "\n".join([*rows, *sections[0], *sections[1]]) + "\n"


def quality_measures() -> str:
    """The page of quality measures, its table as the program has it."""
    rows = [f"| `{one.name}` | {one.unit} | {one.worse} | {one.definition} |" for one in MEASURES.values()]
    above, head, below = QUALITY.read_text("utf-8").partition("|---|---|---|---|\n")
    return above + head + "\n".join([*rows, "", ""]) + below.partition("\n\n")[2]


def _first_line(name: str) -> str:
    return (inspect.getdoc(getattr(restore, name)) or "").partition("\n")[0].replace("|", "\\|")
