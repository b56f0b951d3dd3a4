"""`python -m bench.constants [--write-docs]`: the named numbers of `restore`, by kind, and those that a scan reads.

The default path is what restoring two scans of a printed page calls: FAST on a white table, FINE on a dark one.
"""

from __future__ import annotations

import argparse

from oracles.constants_page import PAGE, page


def main(*, write: bool) -> None:
    """Print the page; write: write it to the reference."""
    text = page()
    print(text)
    if write:
        PAGE.write_text(text, "utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write-docs", action="store_true")
    main(write=parser.parse_args().write_docs)
