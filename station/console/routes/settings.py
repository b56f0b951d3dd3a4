"""Routes of the settings."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from station.console.routes.answers import FAULTS, Acting, Looking
from station.console.routes.requests import ChangedSettings

router = APIRouter(prefix="/api", responses=FAULTS)


@router.get("/settings")
def settings(app_state: Looking) -> dict[str, Any]:
    """Return the settings with their ranges and units.

    Next to those of the preset.
    """
    return app_state.all_settings()


@router.put("/settings")
def change(app_state: Acting, wanted: ChangedSettings) -> dict[str, Any]:
    """Change settings, for scans and restorations from now on."""
    return app_state.change(wanted.values)
