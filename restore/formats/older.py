"""Names of provenance in scan folders of earlier programs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

KEYS: Mapping[str, str] = {
    "assurance": "integrity",
    "super": "super_resolution",
    "turn": "turntable",
    "views": "view_registrations",
    "picture": "texture_source",
    "lit_share": "lit_fraction",
    "measured_share": "decoded_fraction",
}
INTEGRITY: Mapping[str, str] = {"checksummed": "checksum", "doubled": "read_twice", "single": "read_once"}


def current_provenance(provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Return the provenance of a scan under today's names.

    No earlier name has another meaning today.

    >>> current_provenance({"device": "mine", "assurance": "doubled", "super": {"shots": 4, "factor": 2}})
    {'device': 'mine', 'integrity': 'read_twice', 'super_resolution': {'factor': 2, 'captures': 4}}
    """
    table = {KEYS.get(key, key): value for key, value in provenance.items()}
    if table.get("integrity") in INTEGRITY:
        table["integrity"] = INTEGRITY[table["integrity"]]
    if isinstance(table.get("super_resolution"), Mapping) and "shots" in table["super_resolution"]:
        summary = dict(table["super_resolution"])
        captures = summary.pop("shots")
        table["super_resolution"] = {**summary, "captures": captures}
    if table.get("device") == "structured light" and "pictures" in table:
        table["captures"] = table.pop("pictures")
    return table
