"""The process that Python keeps next to spawned ones for as long as it runs."""

from multiprocessing import resource_tracker

resource_tracker.ensure_running()
