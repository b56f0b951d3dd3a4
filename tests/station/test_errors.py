"""What the operator is told of an error of the disk."""

import errno

import pytest

from station.errors import DISK, explain

HINT = "free some space on the disk at /, or use another disk"


@pytest.mark.parametrize("name", ["x" * 300, "x" * 300 + "/y", "/" + "x/" * 5000, "\0", "", "/none/at/all"])
def test_an_error_of_any_name_is_explained(name):
    fault = explain(OSError(errno.ENOSPC, "No space left on device", name))
    assert fault.exit_code == DISK
    assert fault.hints in ((HINT.replace(" on the disk at /", ""),), (HINT,))


def test_the_disk_is_named_where_there_is_one(tmp_path):
    fault = explain(OSError(errno.ENOSPC, "No space left on device", str(tmp_path / "a.png")))
    assert " on the disk at /" in fault.hints[0]


def test_a_circle_of_links_is_explained(tmp_path):
    (tmp_path / "a.png").symlink_to("a.png")
    fault = explain(OSError(errno.ELOOP, "Too many levels of symbolic links", str(tmp_path / "a.png")))
    assert fault.exit_code == DISK


@pytest.mark.parametrize("number", [errno.EACCES, errno.EPERM])
def test_a_right_that_is_missed_may_be_that_to_read(number):
    fault = explain(OSError(number, "Permission denied", "a.ply"))
    assert fault.message == "cannot use a.ply: Permission denied"
    assert "or not read" in fault.hints[0]
