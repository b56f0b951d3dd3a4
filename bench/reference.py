"""`python -m bench.reference [--write-docs]`: the reference pages that follow from the code."""

from __future__ import annotations

import argparse

from oracles import command_reference, reference

PAGES = {
    reference.PAGE: reference.reference,
    reference.REPORT: reference.report,
    reference.QUALITY: reference.quality_measures,
    command_reference.PAGE: command_reference.command_reference,
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write-docs", action="store_true")
    write = parser.parse_args().write_docs
    for page, text in PAGES.items():
        if write:
            page.parent.mkdir(exist_ok=True)
            page.write_text(text(), "utf-8")
        else:
            print(text(), end="")
