"""The options of a run, from those of a command."""

import pytest

from restore import Settings
from station.choices import Rotation
from station.commands.options import Kinds, Restoration, run_options
from station.errors import UsageError
from station.run.options import RunOptions


def test_options_of_a_command_are_those_of_its_run():
    options = run_options("restore", Kinds(tiff=True, language="lat"), Restoration(dpi=300), rotate=Rotation.HALF)
    assert options == RunOptions(Settings(dpi=300), frozenset({"tiff"}), "lat", rotate=Rotation.HALF)
    assert options.settings.model_fields_set == {"dpi"}


def test_a_setting_that_is_not_usable_has_the_name_of_its_option():
    with pytest.raises(UsageError, match=r"^--inpaint: 99\.0 is not usable") as caught:
        run_options("watch", Kinds(), Restoration(inpaint_mm=99.0))
    assert caught.value.hint == "see planish watch --help"
