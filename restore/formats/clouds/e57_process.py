"""The process of `restore.formats.clouds.e57`, which writes arrays to standard output.

It is run as a script, so that it loads no more than it needs.
"""

from __future__ import annotations

import io
import resource
import sys
from typing import Any

import numpy as np
import pye57

MAX_MEMORY = 2**32  # bytes of addresses; eight million points take half of it


def main(path: str, limit: int) -> None:
    """Write points (n, 3), what they have in addition, and the pose (4, 3) of the first scan."""
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))
    file = pye57.E57(path)
    headers = [file.get_header(k) for k in range(file.scan_count)]
    count = sum(header.point_count for header in headers)
    if not 0 < count <= limit:
        sys.exit(f"it has {count} points, and more than none and at most {limit} are read")
    scans = [
        file.read_scan(k, intensity=True, colors=True, row_column=True, ignore_missing_fields=True)
        for k in range(len(headers))
    ]
    wanted = {"points": ["cartesianX", "cartesianY", "cartesianZ"], "intensity": ["intensity"]}
    wanted |= {"colours": ["colorRed", "colorGreen", "colorBlue"]}
    wanted |= {"places": ["rowIndex", "columnIndex"]} if len(scans) == 1 else {}
    arrays: dict[str, Any] = {}
    for name, fields in wanted.items():
        if all(field in scan for scan in scans for field in fields):
            arrays[name] = np.concatenate([np.column_stack([scan[field] for field in fields]) for scan in scans])
    if "colours" in arrays:
        scale = 255.0 / max(float(arrays["colours"].max()), 255.0)
        arrays["colours"] = (arrays["colours"] * scale).astype(np.uint8)
    if "intensity" in arrays:
        arrays["intensity"] = arrays["intensity"][:, 0]
    pose = np.vstack([np.eye(3), np.zeros(3)])
    if headers[0].has_pose():
        pose = np.vstack([headers[0].rotation_matrix, headers[0].translation])
    out = io.BytesIO()
    np.savez(out, pose=pose, **arrays)
    sys.stdout.buffer.write(out.getbuffer())


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
