"""`python -m bench.constants [--write-docs]`: every constant of the default method with its reason, and how many."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from oracles.constants import ENGINE, ROOT, constants_of

PAGE = ROOT / "docs" / "reference" / "constants.md"
ASKED = 32  # a third of the 97 of the method before


def table() -> str:
    """A line for each constant of the engine, and their number."""
    lines = ["| module | constant | value | reason |", "|---|---|---|---|"]
    for module in ENGINE:
        for name, value, reason in constants_of(ROOT / module):
            cell = reason.replace("|", "\\|")
            lines.append(f"| {Path(module).stem} | `{name}` | {value} | {cell} |")
    return "\n".join([*lines, "", f"{len(lines) - 2} constants; {ASKED} are aimed at."])


def main(*, write: bool) -> None:
    """Print the table; write: write it to the reference page."""
    print(table())
    if write:
        page = PAGE.read_text("utf-8")
        found = re.sub(
            r"(<!-- constants -->\n).*?(<!-- end -->)", lambda m: m[1] + table() + "\n" + m[2], page, flags=re.DOTALL
        )
        PAGE.write_text(found, "utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write-docs", action="store_true")
    main(write=parser.parse_args().write_docs)
