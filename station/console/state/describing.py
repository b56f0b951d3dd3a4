"""Describe the volume of a session: title, creators, language, rights and so on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from restore import BadInput
from station.capture_loop.loop import CaptureLoop
from station.console.faults import ConsoleFault
from station.console.state.open_session import WritableSession
from station.session import Session, decide
from station.session.log.current import about_of
from station.session.terms.about import ABOUT, about_from


def shown_about(session: Session) -> dict[str, Any]:
    """Return the description of a volume as JSON values, with its tag."""
    return {"tag": _tag(session), "about": about_of(session.history).given()}


def describe(opened: WritableSession, about: Mapping[str, Any], tag: int) -> dict[str, Any]:
    """Record the description of a volume, and return it as it stands then.

    tag: of the description that it was made from. Nothing is recorded where it stays.
    Raises ConsoleFault for values that cannot be, and with the present ones where the tag is another's; UsageError for
    control characters.
    """
    try:
        wanted = about_from(about, ABOUT).given()
    except BadInput as error:
        raise ConsoleFault("invalid", str(error), error.hint) from error

    def record(loop: CaptureLoop) -> dict[str, Any]:
        session = loop.writer.session
        if _tag(session) != tag:
            raise ConsoleFault.changed("the volume was described meanwhile", shown_about(session))
        if wanted != about_of(session.history).given():
            decide(loop.writer, ABOUT, wanted)
            loop.changed()
        return shown_about(loop.writer.session)

    return opened.ask(record)


def _tag(session: Session) -> int:
    event = session.history.volume.decisions.get(ABOUT)
    return 0 if event is None else event.number
