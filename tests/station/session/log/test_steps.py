"""Undo and redo of the runs of a stage."""

from __future__ import annotations

from station.session import add_scan, open_session, redo_run, undo_run
from station.session.log.steps import record_run


def test_runs_of_a_stage_are_undone_and_redone_by_themselves(volume, tiny_scan):
    with open_session(volume) as writer:
        capture = add_scan(writer, tiny_scan, facts={})
        coarse = record_run(writer, "restore", capture, parameters={"dpi": 150}, result={})
        checked = record_run(writer, "verdict", coarse, parameters={}, result={"level": "green", "checks": []})
        fine = record_run(writer, "restore", capture, parameters={"dpi": 300}, result={})
        assert dict(writer.history.page(1).runs) == {"restore": fine}
        assert undo_run(writer, 1, "restore") == fine
        assert dict(writer.history.page(1).runs) == {"restore": coarse, "verdict": checked}
        assert undo_run(writer, 1, "verdict") == checked
        assert redo_run(writer, 1, "verdict") == checked
        assert redo_run(writer, 1, "restore") == fine
        assert redo_run(writer, 1, "restore") is None
        assert undo_run(writer, 1, "words") is None
        undo_run(writer, 1, "restore"), undo_run(writer, 1, "restore")
        assert dict(writer.history.page(1).runs) == {}
        assert redo_run(writer, 1, "restore") == coarse
