"""The frame of an organised cloud is a scanner's, whatever its file says."""

import numpy as np

from restore.formats.clouds.cloud import cloud_of
from restore.formats.clouds.frame import in_scanner_frame


def test_a_mirrored_file_of_a_stated_handedness_is_seen_from_its_other_side(sheet, tmp_path):
    rows, cols, _ = sheet.points.shape
    mirrored = (sheet.points * [-1.0, 1.0, 1.0]).reshape(-1, 3)
    found = {}
    for frame in ("right-handed", "either"):
        points, found[frame] = in_scanner_frame(cloud_of(tmp_path / "a", mirrored, size=(cols, rows), frame=frame))
        assert (points[np.isfinite(points[..., 2]), 2] < 0).all()
    assert found == {"right-handed": True, "either": False}


def test_a_scan_in_the_frame_of_the_scanner_stays_as_it_is(sheet, tmp_path):
    rows, cols, _ = sheet.points.shape
    points, reversed_ = in_scanner_frame(cloud_of(tmp_path / "a", sheet.points.reshape(-1, 3), size=(cols, rows)))
    np.testing.assert_allclose(points, sheet.points)
    assert not reversed_
