"""`python -m bench.reference [--write-docs]`: the reference of keys and of the public API, out of the code."""

from __future__ import annotations

import argparse

from oracles.reference import PAGE, reference

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write-docs", action="store_true")
    if parser.parse_args().write_docs:
        PAGE.parent.mkdir(exist_ok=True)
        PAGE.write_text(reference(), "utf-8")
    else:
        print(reference(), end="")
