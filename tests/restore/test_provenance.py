"""A provenance that the restoration cannot read is refused before any work, and before it is stored."""

import numpy as np
import pytest

from restore import BadInput, RangeScan, save_scan
from restore.scan_check import check_provenance

UNREADABLE = [
    (None, "not a dictionary"),
    ([1], "not a dictionary"),
    ({"super_resolution": {"factor": 0}}, r"provenance\.super_resolution\.factor"),
    ({"oversampling": 0.0}, r"provenance\.oversampling"),
    ({"turntable": {"deg": 3, "axis": {"point_mm": [0, 0, 0], "direction": [0, 0, 0]}}}, "direction has no length"),
]


@pytest.mark.parametrize(("provenance", "fault"), UNREADABLE)
def test_what_cannot_be_read_is_named(provenance, fault):
    with pytest.raises(BadInput, match=fault) as reported:
        check_provenance(provenance)
    assert reported.value.hint


def test_what_is_free_is_left_alone():
    check_provenance({"device": "any", "super_resolution": {"factor": 2, "captures": 8}, "oversampling": 1.5})


@pytest.mark.parametrize("provenance", [*(value for value, _ in UNREADABLE), {1: 2}, {"a": {1, 2}}])
def test_what_cannot_be_read_or_written_is_not_stored(tmp_path, provenance):
    scan = RangeScan(np.zeros((2, 2, 3)), None, np.zeros((2, 2, 2)), provenance)
    with pytest.raises(BadInput):
        save_scan(scan, tmp_path / "scan")
    assert not (tmp_path / "scan").exists()
