"""What the tests of sessions have, and the process that Python keeps beside spawned ones for as long as it runs."""

from multiprocessing import resource_tracker

from tests.station.session.conftest import tiny_scan

__all__ = ["tiny_scan"]

resource_tracker.ensure_running()
