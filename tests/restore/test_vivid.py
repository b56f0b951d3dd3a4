"""The shared optical constants against the table of fields of view in the hardware manual, p. 26."""

import pytest

from restore.vivid import FOCAL_PX, TEXTURE_COLS, TEXTURE_ROWS

# Lens → two distances, and the width and height of the field of view at each, mm. Differences are free of the pupil.
FIELDS = {
    "TELE": ((600, 113.9, 85.4), (2500, 465.9, 349.4)),
    "MIDDLE": ((600, 204.7, 153.6), (2500, 830.6, 622.9)),
    "WIDE": ((600, 367.0, 275.2), (2000, 1204.2, 903.2)),
}
ROUNDED_MM = 0.22  # two values, each rounded to 0.1 mm and with a height that is off by as much from 3/4 of its width


@pytest.mark.parametrize("lens", FOCAL_PX)
def test_fields_of_view_grow_with_distance_as_the_focal_length_says(lens: str) -> None:
    (near, *narrow), (far, *wide) = FIELDS[lens]
    for pixels, small, large in zip((TEXTURE_COLS, TEXTURE_ROWS), narrow, wide, strict=True):
        assert pixels * (far - near) / FOCAL_PX[lens] == pytest.approx(large - small, abs=ROUNDED_MM)
