"""Routes of the settings."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from station.console.routes.answers import FAULTS, Acting, Looking
from station.console.routes.requests import ChangedSettings

router = APIRouter(prefix="/api", responses=FAULTS)


@router.get("/settings")
def settings(desk: Looking) -> dict[str, Any]:
    """The settings with their ranges and units, beside those of the preset."""
    return desk.all_settings()


@router.put("/settings")
def change(desk: Acting, wanted: ChangedSettings) -> dict[str, Any]:
    """Change settings, for scans and restorations from now on."""
    return desk.change(wanted.values)
