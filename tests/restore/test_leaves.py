"""What is kept of a scan changes nothing of its next restoration, whichever field differs."""

from __future__ import annotations

import json

import pytest

from restore import PageEdits, PartEdits, Settings, restore_leaves
from restore.runtime import Kept
from tests.restore.layout.conftest import shot

COARSE = Settings(points=300, dpi=40)
AREA = ((200.0, 150.0), (260.0, 150.0), (260.0, 230.0), (200.0, 230.0))
OF_SETTINGS = {
    "points": 400,
    "dpi": 50.0,
    "method": "conformal",
    "shading": "remove",
    "white_balance": "paper",
    "inpaint_mm": 3.0,
    "uncertainty": True,
}
OF_PARTS = {
    "outline": ((80.0, 60.0), (330.0, 60.0), (330.0, 420.0), (80.0, 420.0)),
    "masks": ({"what": "remove", "polygon": AREA},),
    "turn": 1,
    "rotate_deg": 2.0,
    "crop": {"mode": "margin", "margin_mm": 3.0},
    "size_mm": (120.0, 140.0),
    "settings": {"method": "springs"},
    "label": "12",
}
OF_PAGES = {"layout": "whole", "overlap_mm": 4.0, "spine": ((330.0, 80.0), (332.0, 400.0))}


def restored(kept: Kept | None, settings: Settings = COARSE, **edits: object) -> list[object]:
    """All that a restoration of the left leaf gives but its seconds."""
    given = PageEdits.model_validate({"layout": "left", **edits})
    found = []
    for part, page in restore_leaves(shot(False)[0], settings, edits=given, kept=kept).parts():
        report = {name: value for name, value in page.report.items() if name != "seconds"}
        pictures = {name: rows().tobytes() for name, rows in page.pictures.items()}
        found.append((part, json.dumps(report), pictures, page.flat.flat.tobytes(), page.fine.lengths.tobytes()))
    return found


@pytest.mark.slow
def test_no_field_is_forgotten():
    assert OF_SETTINGS.keys() == Settings.model_fields.keys()
    assert OF_PARTS.keys() == PartEdits.model_fields.keys()
    changes = [{}, *({"settings": COARSE.model_copy(update={name: value})} for name, value in OF_SETTINGS.items())]
    changes += [{"parts": {"left": {name: value}}} for name, value in OF_PARTS.items()]
    changes += [{name: value} for name, value in OF_PAGES.items()]
    kept = Kept()
    for change in changes:
        with kept.of_page("scan"):
            again = restored(kept, **change)
        assert again == restored(None, **change), change
        assert len(kept) > 0
