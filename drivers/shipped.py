"""The station configurations, command profiles and udev rules that come with Planish.

They stand in `configs/` at the root of the sources. The link `drivers/configs` brings them into the built package, so
that an installation without a checkout finds them at the same place.
"""

from pathlib import Path

CONFIGS = Path(__file__).parent / "configs"
