"""`python -m bench.flattening [--write-docs]`: the tables of `bench/results/flattening.md`, printed or written."""

from __future__ import annotations

import argparse
import io
import re
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path

from bench import growth, paper, paper_meshes, peers, random_sheets, same_strain

PAGE = Path(__file__).parent.parent / "bench" / "results" / "flattening.md"
# Name of the table in the page, between <!-- name --> and <!-- end -->, and what prints it.
TABLES: dict[str, Callable[[], object]] = {
    "paper": paper.main,
    "same strain": same_strain.main,
    "meshes": paper_meshes.main,
    "growth": lambda: growth.main(growth.PLOT),
    "random": random_sheets.main,
    "peers": peers.main,
}


class Tee(io.StringIO):
    """Shows on the terminal what it keeps."""

    def write(self, text: str) -> int:
        sys.__stdout__.write(text)
        return super().write(text)

    def flush(self) -> None:
        sys.__stdout__.flush()


def main(*, write: bool = False, only: tuple[str, ...] = ()) -> None:
    """Print the tables; write: put them into the page of results as they are printed."""
    for name, table in TABLES.items():
        if only and name not in only:
            continue
        printed = Tee()
        with redirect_stdout(printed):
            table()
        if write:
            PAGE.write_text(_replaced(PAGE.read_text(), name, printed.getvalue().strip("\n")))


def _replaced(page: str, name: str, table: str) -> str:
    """The page with another table of that name."""
    pattern = re.compile(rf"(<!-- {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
    text, count = pattern.subn(lambda found: f"{found[1]}```\n{table}\n```\n{found[2]}", page)
    if count != 1:
        raise ValueError(f"{PAGE.name} has {count} places for the table {name!r}")
    return text


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write-docs", action="store_true")
    parser.add_argument("--only", action="append", default=[], choices=TABLES)
    options = parser.parse_args()
    main(write=options.write_docs, only=tuple(options.only))
