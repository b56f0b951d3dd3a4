"""The page with the reference of keys and of the public API, out of the code."""

from __future__ import annotations

import inspect
import re

import restore
from oracles import ROOT
from oracles.keys import GENERIC, KEYS, REPORT_KEYS, fields_of, json_type
from restore.report import PhotogrammetryReport, Report
from station.verdict.table import MEASURES

REPORT = ROOT / "docs" / "reference" / "report.md"
QUALITY = ROOT / "docs" / "reference" / "quality-measures.md"
PAGE = ROOT / "docs" / "reference" / "keys.md"
HEAD = """# Keys and names

Written by `python -m bench.reference --write-docs`. A name has the same meaning in reports, presets, events and
configurations. Types are those of JSON: a flag is true or false, a table an object, a list is in brackets.
Keys of a [report](report.md) and [quality measures](quality-measures.md) have their own pages; in `thresholds` each
measure has its amber and its red limit.

## Keys

| key | type | unit | meaning |
|---|---|---|---|
"""


def reference() -> str:
    """The page: a line for each key, for each generic word, and for each name of the public API."""
    rows = [
        f"| `{name}` | {key.type.replace('|', ' or ')} | {key.unit} | {key.meaning} |"
        for name, key in sorted(KEYS.items())
        if name not in MEASURES and REPORT_KEYS.get(name) != key
    ]
    words = [f"| `{name}` | {meaning} |" for name, meaning in sorted(GENERIC.items())]
    names = [f"| `{name}` | {_first_line(name)} |" for name in sorted(restore.__all__)]
    sections = (
        ["\n## Words that need their table\n", "| key | meaning |", "|---|---|", *words],
        ["\n## Python: `restore`\n", "| name | what it is |", "|---|---|", *names],
    )
    return HEAD + "\n".join([*rows, *sections[0], *sections[1]]) + "\n"


def report() -> str:
    """The page of the report. A table has the keys that it names already, and those in them."""
    rows = report_rows()

    def table(found: re.Match[str]) -> str:
        names = dict.fromkeys(re.findall(r"^\| `(\w+)", found[2], re.MULTILINE))
        return found[1] + "".join(f"{row}\n" for name in names for row in rows[name])

    return re.sub(r"(\| key \| type .*\n\|---.*\n)((?:\|.*\n)*)", table, REPORT.read_text("utf-8"))


def report_rows() -> dict[str, list[str]]:
    """The rows of each key of a report: its own, or those of the keys in it."""
    rows: dict[str, list[str]] = {}
    fields = [*fields_of(Report), *fields_of(PhotogrammetryReport, ("photogrammetry",))]
    above = {field.path[:-1] for field in fields if field.meaning}
    for field in fields:
        if field.meaning and field.path not in above:
            kind = json_type(field.type).replace("|", " or ")
            rows.setdefault(field.path[0], []).append(f"| `{'.'.join(field.path)}` | {kind} | {field.meaning} |")
    return rows


def quality_measures() -> str:
    """The page of quality measures, its table as the program has it."""
    rows = [f"| `{one.name}` | {one.unit} | {one.worse} | {one.definition} |" for one in MEASURES.values()]
    above, head, below = QUALITY.read_text("utf-8").partition("|---|---|---|---|\n")
    return above + head + "\n".join([*rows, "", ""]) + below.partition("\n\n")[2]


def _first_line(name: str) -> str:
    return (inspect.getdoc(getattr(restore, name)) or "").partition("\n")[0].replace("|", "\\|")
