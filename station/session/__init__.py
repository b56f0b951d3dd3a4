"""Sessions: a volume in a folder that is a BagIt bag.

It is written one event at a time and never overwritten.

events    what one record holds, and its line of JSON
history   pages and pointers: a fold over the events
bag       tag files as functions of the events
reading   what the folder holds, and completing what an interrupted writer left
store     create, read, open for writing; one event at a time
operations  every change by an operator
volume    what a session is of
"""

from station.session.captures.scans import add_files, add_scan, scan_path
from station.session.log.events import VOLUME, Event, Input, slot_of
from station.session.log.history import History, Page
from station.session.log.reading import SessionDamaged
from station.session.log.steps import redo_run, undo_run
from station.session.log.store import Session, SessionBroken, Writer, create_session, open_session, read_session
from station.session.operations.corrections import add_rule, correct, redo, undo
from station.session.terms.volume import Volume

__all__ = [
    "VOLUME",
    "Event",
    "History",
    "Input",
    "Page",
    "Session",
    "SessionBroken",
    "SessionDamaged",
    "Volume",
    "Writer",
    "add_files",
    "add_rule",
    "add_scan",
    "correct",
    "create_session",
    "open_session",
    "read_session",
    "redo",
    "redo_run",
    "scan_path",
    "slot_of",
    "undo",
    "undo_run",
]
