"""What follows from the options of a run."""

import pytest

from restore import Settings
from station.run.options import RunOptions

TIFF = frozenset({"tiff"})


@pytest.mark.parametrize(
    ("options", "implied"),
    [
        (RunOptions(outputs=TIFF), set()),
        (RunOptions(Settings(shading="remove"), TIFF), {"master"}),
        (RunOptions(outputs=TIFF, to_srgb=True), {"master"}),
        (RunOptions(Settings(inpaint_mm=2.0), TIFF), {"coverage"}),
        (RunOptions(Settings(uncertainty=True), TIFF), {"uncertainty"}),
        (RunOptions(Settings(white_balance="paper", inpaint_mm=2.0), TIFF), {"master", "coverage"}),
    ],
)
def test_options_imply_outputs(options, implied):
    assert options.with_implied_outputs().outputs == {"tiff"} | implied
