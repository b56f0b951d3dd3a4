"""`planish patterns`: the Gray-code pictures that a projector shows.

With an index of what they are.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from station.commands.options import Debug, Force, output_path
from station.commands.terminal import print_result, report_faults

SIZE = re.compile(r"(?P<width>\d{1,5})[x×](?P<height>\d{1,5})")
INDEX = "patterns.json"


def patterns(
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="FOLDER", help="Folder to write.", show_default=False, parser=output_path
        ),
    ],
    projector: Annotated[
        str, typer.Option(metavar="WxH", help="Resolution of the projector, as 1280x800.", show_default=False)
    ],
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Write Gray-code patterns for structured light."""
    with report_faults(debug=debug):
        from station.storage.atomic import write_all

        width, height = parse_size(projector)
        paths = write_all(pattern_files(output, width, height), force=force)
        print_result(
            f"{output}: {len(paths) - 1} patterns. Show each at its full size, take one image of each, the camera "
            f"fixed, in this order, and put the images in a folder with {INDEX} and the calibration: "
            "planish restore FOLDER -o OUT"
        )


def parse_size(text: str) -> tuple[int, int]:
    """Return width and height of a text WxH.

    Raises UsageError for another, and for a size that no projector has.
    """
    from restore import BadInput, Projector
    from station.errors import UsageError

    size = SIZE.fullmatch(text.strip().lower())
    if size is None:
        raise UsageError(f"--projector: {text!r} is not a resolution", "give its width and height in pixels: 1280x800")
    try:
        projector = Projector(int(size["width"]), int(size["height"]))
    except BadInput as error:
        raise UsageError(f"--projector: {error}", error.hint) from error
    return projector.width, projector.height


def pattern_files(folder: Path, width: int, height: int) -> Iterator[tuple[Path, bytes]]:
    """Yield the files of the patterns.

    Pictures in the order in which they are shown, and the index.
    """
    import numpy as np

    from restore import Projector
    from restore.formats import encode_png

    projector = Projector(width, height)
    for number, pattern in enumerate(projector.patterns()):
        yield folder / f"pattern_{number:02d}.png", encode_png(np.repeat(pattern[..., None], 3, axis=2))
    index = {"projector": [width, height], "patterns": projector.count}
    yield folder / INDEX, (json.dumps(index) + "\n").encode()
