"""What the tests of sessions have."""

from tests.station.session.conftest import tiny_scan

__all__ = ["tiny_scan"]
