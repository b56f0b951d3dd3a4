"""The options of benches that draw their cases afresh at every run."""

from __future__ import annotations

import argparse
import datetime


def seed_of_today() -> int:
    """The date of today as a number, 20260101 and so on."""
    return int(datetime.date.today().strftime("%Y%m%d"))


def draws_parser(description: str | None, count: int) -> argparse.ArgumentParser:
    """A parser of --count, how many cases are drawn, and of --seed."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--seed", type=int)
    return parser
