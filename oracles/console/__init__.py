"""A station of canned answers, for tests and benches of the console's page."""

from oracles.console.answers import preview
from oracles.console.serving import serving
from oracles.console.station import CannedStation

__all__ = ["CannedStation", "preview", "serving"]
