"""Where a job writes: beside the sessions, and never into one."""

from __future__ import annotations

import pytest

from station.console.state.tasks import export_task
from station.errors import UsageError
from station.storage.session_folder import EXPORTS


def test_an_export_is_next_to_the_sessions(root):
    kind, about, task = export_task(root, root / "missale", "pdf", None)
    assert (kind, about) == ("export", {"session": "missale", "format": "pdf"})
    assert task["out"] == str(root / EXPORTS / "missale-pdf")


def test_a_session_of_that_name_is_not_written_into(root):
    (root / "missale").rename(root / EXPORTS)
    with pytest.raises(UsageError, match="session"):
        export_task(root, root / "other", "pdf", None)
