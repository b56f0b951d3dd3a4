"""The version of Planish, as it is written into every record."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version


@cache
def software_version() -> str:
    """Return name and version, `planish 0.1.0`; no number where it is not installed."""
    try:
        return f"planish {installed_version('planish')}"
    except PackageNotFoundError:
        return "planish, from the sources, not installed"
