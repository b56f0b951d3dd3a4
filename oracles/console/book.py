"""`python -m oracles.console.book FOLDER [OPENING …]`: the console before the simulated scanner and its volume.

The volume is that of `configs/simulated-book.toml`, the openings those that are named by their numbers, all by default.
Prints its link.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from station.config import BOOK, load_config
from station.console.serving import Address, serve
from station.console.state.app_state import AppState


def main(folder: Path, numbers: Sequence[int] = ()) -> int:
    """Serve until a signal ends it."""
    config = load_config(BOOK)
    openings = config.scanner["book"]
    book = [openings[number - 1] for number in numbers] or openings
    config = config.model_copy(update={"scanner": {**config.scanner, "book": book}})
    serve(AppState(folder, config), Address(port=0), show=lambda link: print(link, flush=True))
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve(), [*map(int, sys.argv[2:])]))
