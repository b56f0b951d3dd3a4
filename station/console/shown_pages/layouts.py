"""The layout of a scan as it is found: where the spine is, and whether it is one."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any

from restore import find_layout
from station.console.shown_pages.layers import scan_of
from station.session import Event, Session

MAX_KEPT = 16  # scans: a finding is small, and takes seconds


class Layouts:
    """The layouts that were asked for last; one is looked for at a time."""

    def __init__(self, limit: int = MAX_KEPT) -> None:
        self._limit = limit
        self._kept: OrderedDict[tuple[str, int], Mapping[str, Any]] = OrderedDict()
        self._looking = threading.Lock()

    def of(self, session: Session, capture: Event) -> Mapping[str, Any]:
        """Return the layout of a scan, as `LayoutFinding.as_json`.

        Raises ConsoleFault, RestoreError, OSError.
        """
        key = (session.identifier, capture.number)
        with self._looking:
            if key not in self._kept:
                self._kept[key] = find_layout(scan_of(session, capture)).as_json()
                while len(self._kept) > self._limit:
                    self._kept.popitem(last=False)
            self._kept.move_to_end(key)
            return self._kept[key]
