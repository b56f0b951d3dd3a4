"""The commands that read a restored page: its words, its colours."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from station.commands.options import Debug, Force, Json, Language, output_path
from station.commands.terminal import print_result, report_faults
from station.progress import progress_on


def ocr(
    page: Annotated[Path, typer.Argument(metavar="PAGE", help="A restored page, or its folder of results.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="OUT",
            help="Folder for the text files.",
            show_default="that of the page",
            parser=output_path,
        ),
    ] = None,
    language: Language = "eng",
    ground_truth: Annotated[
        Path | None, typer.Option(help="Text of the page: report the error rate of the recognition.")
    ] = None,
    force: Force = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Recognise text: TXT, ALTO, hOCR and searchable PDF/A.

    Needs Tesseract.
    """
    with report_faults(debug=debug), progress_on(sys.stderr) as progress:
        from station.run.ocr import as_data, read_pages, summary_line

        read = read_pages(page, output, language=language, truth=ground_truth, force=force, progress=progress)
        if as_json:
            print_result(json.dumps({"pages": [as_data(one) for one in read]}, indent=2, ensure_ascii=False))
        else:
            for one in read:
                print_result(summary_line(one))


def colour(
    target: Annotated[
        Path, typer.Argument(metavar="TARGET", help="An image, restored page or scan of a ColorChecker Classic.")
    ],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="PROFILE", help="The ICC profile to write.", parser=output_path),
    ],
    force: Force = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Make an ICC camera profile from a ColorChecker image.

    Reports the levels of FADGI and ISO 19264-1 that the image meets.
    """
    with report_faults(debug=debug):
        from station.colour.run import profile_colours, summary_line

        run = profile_colours(target, output, force=force)
        print_result(json.dumps(run.report, indent=2, ensure_ascii=False) if as_json else summary_line(run))
