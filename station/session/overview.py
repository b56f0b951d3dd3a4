"""What a session holds, page by page: for people and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from station.session.events import VOLUME
from station.session.facts import SETTINGS
from station.session.history import Page, redo_target, undo_target
from station.session.index import level_of, state_of
from station.session.presets import Preset, changed_preset
from station.session.store import Session

ROW = "{:>5}  {:<8} {:<6} {:<9} {:<6} {}"


def preset_of(session: Session) -> Preset:
    """The preset that the session began with, with the settings that were changed since."""
    changed = session.history.page(VOLUME).decided(SETTINGS, {})
    return changed_preset(
        Preset.model_validate(session.volume.preset_values), changed if isinstance(changed, dict) else {}
    )


def label_of(page: Page, position: int, preset: Preset) -> str:
    """Return the label of a page.

    The one that was decided, else that of the preset's foliation at this position of the volume.
    """
    return str(page.decided("label", preset.label(position)))


def overview(session: Session) -> dict[str, Any]:
    """The session as JSON values: what it is of, its pages in the order of the volume."""
    preset, volume = preset_of(session), session.volume
    return {
        "id": session.identifier,
        "folder": str(session.folder),
        **volume.model_dump(mode="json", exclude={"preset_values"}),
        "events": len(session.history.events),
        "pages": [_page(page, at, preset) for at, page in enumerate(session.history.pages(), 1)],
    }


def overview_lines(session: Session) -> Iterator[str]:
    """The session as lines of text."""
    told = overview(session)
    yield f"{told['title']}  {told['project']}".rstrip()
    yield f"{session.folder}, {len(told['pages'])} pages, {told['events']} events, preset {told['preset']}"
    if told["pages"]:
        yield ROW.format("page", "label", "side", "state", "level", "note").rstrip()
    for page in told["pages"]:
        marked = "* " if page["mark"] else ""
        cells = page["page"], page["label"], page["side"], page["state"], page["level"], marked + page["note"]
        yield ROW.format(*(" ".join(str(cell).split()) for cell in cells)).rstrip()
    for gap in missing_labels(session):
        yield f"pages are missing {gap}"
    for name, step in (("undo", undo_target(session.history)), ("redo", redo_target(session.history))):
        if step is not None:
            yield f"{name}: {step.name} of page {step.page}"


def missing_labels(session: Session) -> list[str]:
    """Return where the labels leave out pages: `between 12 and 15`.

    As decided or by the preset.
    """
    preset = preset_of(session)
    labels = [label_of(page, at, preset) for at, page in enumerate(session.history.pages(), 1)]
    numbered = [(label, place) for label in labels if (place := preset.place(label)) is not None]
    return [f"between {one} and {two}" for (one, at), (two, then) in pairwise(numbered) if then > at + 1]


def _page(page: Page, position: int, preset: Preset) -> dict[str, Any]:
    assert page.capture is not None
    return {
        "page": page.number,
        "position": position,
        "label": label_of(page, position, preset),
        "side": str(page.decided("side", preset.side(position))),
        "state": state_of(page),
        "level": level_of(page),
        "mark": bool(page.decided("mark", False)),
        "note": str(page.decided("note", "")),
        "capture": page.capture.number,
        "captured": page.capture.time,
        "runs": {name: run.number for name, run in page.runs.items()},
    }
