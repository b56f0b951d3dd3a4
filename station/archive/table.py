"""The table of the leaf sides of a volume, as `pages.csv`."""

from __future__ import annotations

import csv
import io

from station.archive.volume import Page, Role, Volume

NAME = "pages.csv"
COLUMNS = ("order", "capture", "part", "label", "side", "kind", "width_mm", "height_mm", "edits", "sha512")


def encode_table(volume: Volume) -> bytes:
    """Return the leaf sides of a volume, one in each row, as CSV (RFC 4180) in UTF-8.

    sha512: of the restored page; empty for one that is not restored.
    """
    out = io.StringIO(newline="")
    rows = csv.writer(out)
    rows.writerow(COLUMNS)
    rows.writerows(map(_row, volume.pages))
    return out.getvalue().encode("utf-8", "replace")


def _row(page: Page) -> list[str]:
    file = page.find(Role.PAGE)
    width, height = ("", "") if page.size_mm is None else (f"{side:.2f}" for side in page.size_mm)
    digest = "" if file is None else file.sha512
    place = [str(page.number), str(page.capture or page.number), page.part]
    return [*place, page.label, page.side, page.kind, width, height, page.edits, digest]
