"""A process that keeps what it computed gives what a new process gives, to the byte."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import Future
from functools import partial

import pytest

from drivers.simulated import Facing, Opening, shoot
from station.capture_loop.loop import CaptureLoop
from station.session import add_scan, correct, redo, undo
from station.session.derivation.service import restore_keeping
from station.session.log.facts import SETTINGS
from station.session.log.steps import decide
from station.session.terms.rules import edits_of
from tests.restore.layout.conftest import PAGE_MM

ROTATION = {"rotate_deg": 1.5}
QUARTER = {"turn": 1}
CROP = {"crop": {"mode": "margin", "margin_mm": 3.0}}
LIGHT = {"settings": {"shading": "remove"}}
AREA = {"masks": [{"what": "remove", "polygon": [[40, 40], [80, 40], [80, 80]]}]}


def both(*fields):
    """The same corrections of both leaves."""
    part = {name: value for one in fields for name, value in one.items()}
    return {"parts": {"left": part, "right": part}}


def whole(*fields):
    return {"layout": "whole", "parts": {"page": {name: value for one in fields for name, value in one.items()}}}


def submit(source, parameters, folder):
    """Restore in this process, which keeps what it computed."""
    done = Future()
    done.set_result(restore_keeping(source, parameters, folder))
    return done


@pytest.fixture
def loop(opening):
    """The loop of a session, with the files that the web interface asks for."""
    return CaptureLoop(opening, None, submit, lambda _line: None, outputs=("model",))


def work_off(loop):
    """Carry out what the loop has begun, and return the latest restoration."""
    loop.catch_up()
    while loop.is_busy:
        loop.finish(loop.inbox.get())
    return loop.writer.history.page(1).runs["restore"]


def corrected(loop, edits):
    loop.change(partial(correct, page=1, edits=edits_of(edits)))
    return work_off(loop)


def is_flattened(run):
    """Whether a restoration flattened a leaf, and did not find it flattened."""
    return run.facts["seconds"]["flatten"] > 0.0


def check_reproduced(loop):
    """Derive every run of the session in a new process, and compare all files and results."""
    command = [sys.executable, "-m", "station", "reproduce", str(loop.writer.session.folder), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_corrections_one_after_the_other_are_those_of_a_new_process(loop):
    assert is_flattened(work_off(loop))
    for part in (ROTATION, QUARTER, CROP, LIGHT):
        assert not is_flattened(corrected(loop, both(part)))
    assert not is_flattened(corrected(loop, both(ROTATION, QUARTER, CROP, LIGHT)))
    for step in (undo, undo, redo, undo):
        step(loop.writer)
        work_off(loop)
    assert not is_flattened(corrected(loop, both(LIGHT, QUARTER)))
    check_reproduced(loop)


@pytest.mark.slow
def test_corrections_of_the_shape_are_those_of_a_new_process(loop):
    work_off(loop)
    spine = [
        [x + 4.0, y]
        for x, y in loop.writer.history.page(1).runs["restore"].facts["result"]["parts"]["left"]["layout"]["spine"]
    ]
    for edits in (
        {"spine": spine},
        {"spine": spine, **both(CROP)},
        both(AREA),
        both(AREA, ROTATION),
        whole(),
        whole(LIGHT, ROTATION),
        whole(AREA, QUARTER),
        {"layout": "left"},
        both(QUARTER),
    ):
        corrected(loop, edits)
    check_reproduced(loop)


def test_nothing_kept_of_another_scan_or_preset_is_used(loop):
    work_off(loop)
    again, _ = shoot(Opening(), Facing(left_mm=PAGE_MM[0] / 2, seed=9), page_mm=PAGE_MM, mode="fast")
    add_scan(loop.writer, again, page=1, facts={})
    assert is_flattened(work_off(loop))
    undo(loop.writer)
    work_off(loop)
    decide(loop.writer, SETTINGS, {"settings": {"points": 400}})
    assert is_flattened(corrected(loop, both(ROTATION)))
    check_reproduced(loop)
