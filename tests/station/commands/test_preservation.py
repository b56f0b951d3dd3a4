"""`planish verify` and `reproduce` in JSON."""

import json

from station.cli import main


def test_verify_reports_in_json(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("PLANISH_INDEX", str(tmp_path / "index.sqlite"))
    assert main(["session", "new", str(tmp_path / "book"), "--quiet"]) == 0
    capsys.readouterr()
    (tmp_path / "book" / "extra.txt").write_text("x")
    assert main(["verify", str(tmp_path / "book"), "--json"]) == 6
    (problem,) = json.loads(capsys.readouterr().out)["problems"]
    assert problem["path"] == "extra.txt"
    assert main(["reproduce", str(tmp_path / "book"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"runs": []}
