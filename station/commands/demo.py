"""The command `planish demo`: a simulated page, or a shift over a simulated volume."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from station.commands.options import Kinds, Out, Restoration, Run, grouped, run_options
from station.commands.page import print_report
from station.commands.terminal import print_result, report_faults
from station.progress import progress_on


@grouped
def demo(
    output: Out,
    run: Run,
    book: Annotated[bool, typer.Option("--book", help="A shift over a book of fifteen openings.")] = False,
) -> None:
    """Scan and restore a simulated page; needs no hardware."""
    if book:
        _book(output, run)
        return
    with report_faults(debug=run.debug), progress_on(sys.stderr) as progress:
        from station.config import DEMONSTRATION, load_config
        from station.run.destination import Destination
        from station.run.one_page import scan_page

        turned = {"rotate": run.rotate, "allow_distorted": run.allow_distorted}
        options = run_options("demo", Kinds(review=True), Restoration(), **turned)
        outcome = scan_page(load_config(DEMONSTRATION), Destination(output, run.force), options, progress=progress)
    print_report(outcome, run)


def _book(output: Path, run: Run) -> None:
    """Work the shift, with its lines on stderr, and print its table."""
    with report_faults(debug=run.debug):
        import json

        from station.capture_loop.demonstration import demonstrate, table
        from station.config import BOOK, load_config

        shift = demonstrate(output, load_config(BOOK), lambda message: print(message.text, file=sys.stderr, flush=True))
        print_result(json.dumps(shift.as_json(), indent=2, ensure_ascii=False) if run.as_json else table(shift))
