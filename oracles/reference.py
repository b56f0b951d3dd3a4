"""The page with the reference of keys and of the public API, out of the code."""

from __future__ import annotations

import inspect

import restore
from oracles import ROOT
from oracles.keys import GENERIC, KEYS

PAGE = ROOT / "docs" / "reference" / "keys.md"
HEAD = """# Keys and names

Written by `python -m bench.reference --write-docs`. A name has the same meaning in reports, presets, events and
configurations. Types are those of JSON: a flag is true or false, a table an object, a list is in brackets. In
`thresholds` a measure has its amber and its red limit.

## Keys

| key | type | unit | meaning | module |
|---|---|---|---|---|
"""


def reference() -> str:
    """The page: a line for each key, for each generic word, and for each name of the public API."""
    rows = [
        f"| `{name}` | {key.type.replace('|', ' or ')} | {key.unit} | {key.meaning} | `{key.made}` |"
        for name, key in sorted(KEYS.items())
    ]
    words = [f"| `{name}` | {meaning} |" for name, meaning in sorted(GENERIC.items())]
    names = [f"| `{name}` | {_first_line(name)} |" for name in sorted(restore.__all__)]
    sections = (
        ["\n## Words that need their table\n", "| key | meaning |", "|---|---|", *words],
        ["\n## Python: `restore`\n", "| name | what it is |", "|---|---|", *names],
    )
    return HEAD + "\n".join([*rows, *sections[0], *sections[1]]) + "\n"


def _first_line(name: str) -> str:
    return (inspect.getdoc(getattr(restore, name)) or "").partition("\n")[0].replace("|", "\\|")
